"""Errors estimated from the differences of passes, and the plans that allow an estimate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import sampled
from renderer.convergence import trend
from renderer.progressive import errors_of, squares_of, unknown_error
from schemas.quality import TargetQuality
from schemas.tiles import Pass
from tests.pictures import pictures
from tests.pictures.parts import plan_of

PREVIEW, FIRST, SECOND, THIRD = Pass(0, 4, 0, 1), Pass(1, 1, 0, 1), Pass(2, 1, 1, 4), Pass(3, 1, 4, 16)
POINT = {"type": "point", "position": [0, 1, 2], "color": [1, 1, 1]}


def flat(*colors: float) -> np.ndarray:
    """One pixel."""
    return np.array(colors, dtype=np.float32).reshape(1, 1, 3)


def test_squared_error_of_a_pass() -> None:
    # Means of 1 and of 3 samples differ by 1 / 2; their mean has (1/4) (3/4) of the square of it.
    found = squares_of([(PREVIEW, flat(9, 9, 9)), (FIRST, flat(0.5, 0, 0)), (SECOND, flat(0, 0, 0))])
    assert list(found) == [2]
    assert found[2].total == 0.5**2 * 3 / 16 / 3
    # Normal errors: the estimate and the true one have the variance 2 s^2 each, and E[estimate^2] = 3 s^2.
    assert found[2].variance == pytest.approx(found[2].total ** 2 * (2 + 2) / 3)


def test_pass_is_compared_with_all_before() -> None:
    parts = [(FIRST, flat(1, 1, 1)), (SECOND, flat(0, 0, 0)), (THIRD, flat(0.75, 0.75, 0.75))]
    assert squares_of(parts)[3].total == (0.75 - 0.25) ** 2 * 3 / 16


def test_values_above_1_are_clipped() -> None:
    assert squares_of([(FIRST, flat(1, 5, 2)), (SECOND, flat(3, 1, 9))])[2].total == 0
    assert squares_of([(FIRST, flat(5, 5, 5)), (SECOND, flat(0, 0, 0))])[2].total == 3 / 16


def test_tiles_add_up() -> None:
    random = np.random.default_rng(3)
    passes = [random.random((4, 6, 3), dtype=np.float32) for _ in range(2)]
    whole = squares_of(list(zip((FIRST, SECOND), passes, strict=True)))
    tiles = [
        squares_of([(FIRST, passes[0][:, part]), (SECOND, passes[1][:, part])])
        for part in (slice(0, 2), slice(2, 6))
    ]
    one, other = errors_of([whole], 24)[2], errors_of(tiles, 24)[2]
    assert other.document() == pytest.approx(one.document(), rel=1e-13)


def test_error_is_unbiased_and_in_its_interval() -> None:
    """Normal samples of deviation 1/20 about 1/2, ten of which lie between it and the clipping."""
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
    # Four standard deviations of a mean: one right renderer in 16,000 fails.
    room = 4 * (estimated - true).std(ddof=1) / np.sqrt(trials)
    assert abs((estimated - true).mean()) < room
    assert estimated.mean() == pytest.approx(0.05**2 / 4, abs=4 * estimated.std(ddof=1) / np.sqrt(trials))
    assert held.mean() > 0.95 - 4 * np.sqrt(0.95 * 0.05 / trials)


@pytest.mark.parametrize("pattern", ["uniform", "rotated", "stratified", "sobol"])
def test_dependent_samples_give_no_error(pattern: str) -> None:
    plan = plan_of(pictures.of_room(sampling=sampled(4, 4, pattern, "random")))
    reason = unknown_error(plan)
    assert reason is not None
    assert repr(pattern) in reason


@pytest.mark.parametrize("light", ["random", "stratified", "sobol"])
def test_random_samples_give_an_error(light: str) -> None:
    assert unknown_error(plan_of(pictures.of_room(sampling=sampled(4, 4, "random", light)))) is None


def test_shared_light_points_give_no_error() -> None:
    document = pictures.of_room(sampling=sampled(4, 4, "random", "uniform"))
    reason = unknown_error(plan_of(document))
    assert reason is not None
    assert "'uniform'" in reason
    assert unknown_error(plan_of(document | {"lights": [POINT]})) is None


def test_one_sample_gives_no_error() -> None:
    reason = unknown_error(plan_of(pictures.of_room(sampling=sampled(1, 4, "random", "random"))))
    assert reason is not None
    assert "one camera sample" in reason


def report_of(document: dict[str, Any], **options: Any) -> dict[str, Any]:
    return renderer.render(plan_of(document), **options).report


@pytest.mark.parametrize("watched", [False, True])
def test_report_of_passes(watched: bool) -> None:
    events: list[Any] = []
    document = pictures.of_room(sampling=sampled(16, 4, "random", "random"))
    report = report_of(document, on_tile=events.append if watched else None, tile_size=8)
    passes = report["passes"]
    assert len(passes) == 3 + watched
    for name in ("seconds", "cpu_seconds"):
        assert [entry[name] for entry in passes] == sorted(entry[name] for entry in passes)
    previews = -(-24 // 4) * -(-16 // 4) * watched
    assert [entry["rays"]["camera"] for entry in passes[-3:]] == [
        previews + samples * 24 * 16 for samples in (1, 4, 16)
    ]
    assert passes[-1]["rays"] == report["rays"]
    assert passes[-1]["cpu_seconds"] == report["cpu_seconds"]
    assert passes[-1]["seconds"] <= report["seconds"]
    assert [entry["error"] is None for entry in passes[-3:]] == [True, False, False]
    assert passes[-1]["error"] == report["error"]
    assert report["convergence"] == trend(passes)


def test_report_of_an_unknown_error() -> None:
    document = pictures.of_room(sampling=sampled(16, 4, "sobol", "random"))
    report = report_of(document)
    assert report["error"] is None
    assert {entry["error"] for entry in report["passes"]} == {None}
    assert report["convergence"] == {
        "order": None,
        "next_halving": None,
        "reason": unknown_error(plan_of(document)),
    }


def test_report_of_target_quality() -> None:
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=0.01))
    report = renderer.render(plan).report
    assert report["passes"][-1]["error"] == report["error"]
    assert report["convergence"] == trend(report["passes"])
