"""Errors estimated from the differences of passes, and the plans that allow an estimate."""

from typing import Any

import numpy as np
import pytest

import renderer
from renderer.convergence import trend
from renderer.progressive import errors_of, squares_of, unknown_error
from schemas.quality import TargetQuality
from schemas.tiles import Pass
from tests.documents import sampled
from tests.pictures import pictures
from tests.pictures.parts import plan_of

PREVIEW, FIRST, SECOND, THIRD = Pass(0, 4, 0, 1), Pass(1, 1, 0, 1), Pass(2, 1, 1, 4), Pass(3, 1, 4, 16)
POINT = {"type": "point", "position": [0, 1, 2], "color": [1, 1, 1]}


def flat(*colors: float) -> np.ndarray:
    """One pixel."""
    return np.array(colors, dtype=np.float32).reshape(1, 1, 3)


def test_squared_error_follows_from_the_sample_counts() -> None:
    # Means of 1 and of 3 samples differ by 1 / 2; their mean has (1/4) (3/4) of the square of it.
    found = squares_of([(PREVIEW, flat(9, 9, 9)), (FIRST, flat(0.5, 0, 0)), (SECOND, flat(0, 0, 0))])
    assert list(found) == [2]
    assert found[2].total == 0.5**2 * 3 / 16 / 3
    # Normal errors: the estimate and the true one have the variance 2 s^2 each, and E[estimate^2] = 3 s^2.
    assert found[2].variance == pytest.approx(found[2].total ** 2 * (2 + 2) / 3)
    # A pass is compared with the mean of all before it.
    parts = [(FIRST, flat(1, 1, 1)), (SECOND, flat(0, 0, 0)), (THIRD, flat(0.75, 0.75, 0.75))]
    assert squares_of(parts)[3].total == (0.75 - 0.25) ** 2 * 3 / 16


@pytest.mark.parametrize(
    ("first", "second", "total"),
    [((1, 5, 2), (3, 1, 9), 0), ((5, 5, 5), (0, 0, 0), 3 / 16), ((np.nan, 0, 0), (0, 0, 0), 3 / 16 / 3)],
)
def test_difference_is_taken_of_clipped_values(first: Any, second: Any, total: float) -> None:
    assert squares_of([(FIRST, flat(*first)), (SECOND, flat(*second))])[2].total == total


def test_tiles_add_up_to_the_picture() -> None:
    random = np.random.default_rng(3)
    passes = [random.random((4, 6, 3), dtype=np.float32) for _ in range(2)]
    whole, *tiles = (
        squares_of([(FIRST, passes[0][:, part]), (SECOND, passes[1][:, part])])
        for part in (slice(None), slice(0, 2), slice(2, 6))
    )
    one, other = errors_of([whole], 24)[2], errors_of(tiles, 24)[2]
    assert other.document() == pytest.approx(one.document(), rel=1e-13)


def test_error_estimate_is_unbiased_and_in_its_interval() -> None:
    """Normal samples about 1/2, ten deviations from clipping; within four standard errors of a mean."""
    random = np.random.default_rng(11)
    pixels, trials = 512, 500
    estimated, true, held = np.zeros((3, trials))
    for trial in range(trials):
        samples = random.normal(0.5, 0.05, (4, pixels)).astype(np.float32)
        parts = [samples[:1].mean(axis=0), samples[1:].mean(axis=0)]
        images = [np.repeat(part[None, :, None], 3, axis=2) for part in parts]
        error = errors_of([squares_of(list(zip((FIRST, SECOND), images, strict=True)))], pixels)[2]
        estimated[trial] = error.estimate**2
        true[trial] = ((samples.mean(axis=0) - 0.5) ** 2).mean()
        held[trial] = error.low <= np.sqrt(true[trial]) <= error.high
    assert abs((estimated - true).mean()) < 4 * (estimated - true).std(ddof=1) / np.sqrt(trials)
    assert estimated.mean() == pytest.approx(0.05**2 / 4, abs=4 * estimated.std(ddof=1) / np.sqrt(trials))
    assert held.mean() > 0.95 - 4 * np.sqrt(0.95 * 0.05 / trials)


@pytest.mark.parametrize(
    ("sampling", "changes", "reason"),
    [
        *((sampled(4, 4, each, "random"), {}, each) for each in ("uniform", "rotated", "sobol")),
        *((sampled(4, 4, "random", light), {}, None) for light in ("random", "stratified", "sobol")),
        (sampled(4, 4, "random", "uniform"), {}, "'uniform'"),
        (sampled(4, 4, "random", "uniform"), {"lights": [POINT]}, None),
        (sampled(1, 4, "random", "random"), {}, "one camera sample"),
    ],
)  # fmt: skip
def test_error_is_known_of_independent_samples_alone(sampling: Any, changes: Any, reason: str | None) -> None:
    found = unknown_error(plan_of(pictures.of_room(sampling=sampling) | changes))
    assert (found is None) if reason is None else (found is not None and reason in found)


@pytest.mark.parametrize("watched", [False, True])
def test_report_has_the_cost_of_each_pass(watched: bool) -> None:
    events: list[Any] = []
    plan = plan_of(pictures.of_room(sampling=sampled(16, 4, "random", "random")))
    report = renderer.render(plan, on_tile=events.append if watched else None, tile_size=8).report
    passes = report["passes"]
    assert len(passes) == 3 + watched
    for name in ("seconds", "cpu_seconds"):
        assert [entry[name] for entry in passes] == sorted(entry[name] for entry in passes)
    previews = -(-24 // 4) * -(-16 // 4) * watched
    rays = [entry["rays"]["camera"] for entry in passes[-3:]]
    assert rays == [previews + samples * 24 * 16 for samples in (1, 4, 16)]
    for name in ("rays", "cpu_seconds", "error"):
        assert passes[-1][name] == report[name]
    assert passes[-1]["seconds"] <= report["seconds"]
    assert [entry["error"] is None for entry in passes[-3:]] == [True, False, False]


def test_report_of_target_quality_has_a_curve() -> None:
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=0.01))
    report = renderer.render(plan).report
    assert report["passes"][-1]["error"] == report["error"]
    assert report["convergence"] == trend(report["passes"])
