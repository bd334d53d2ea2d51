"""Errors of fixed qualities, measured in few pixels."""

from collections import defaultdict
from math import sqrt

import numpy as np
import pytest

import renderer
from accuracy.quotes.accuracies import Accuracy, Sampled, UnknownAccuracyError
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.settings import Ladder, planned
from renderer.math.intervals import Interval
from renderer.scenes import LoadedScene
from schemas.quality import LightSampling
from tests.accuracy.quotes.conftest import edge

LIGHT = LightSampling(pattern="random", samples=1)
RANDOM, UNIFORM, SOBOL = (Ladder(pattern, LIGHT, "single") for pattern in ("random", "uniform", "sobol"))
WIDE, HIGH = 4, 1024
"""A picture of which one pixel in four is on the edge."""


def sampled(scene: LoadedScene, ladder: Ladder, last: Ladder, count: int, seed: int) -> Sampled:
    """One pixel in sixteen of the whole picture."""
    plan = renderer.compile_scene(scene)
    one, another, other = (
        planned(plan, quality, seed + more)
        for more, quality in enumerate((last.quality(16), last.quality(16), ladder.quality(count)))
    )
    found = Sampled((one, another), other)
    found.run(Deadline.after(3600.0))
    return found


def assert_mean_squares(runs: list[Sampled], name: tuple[bool, int], expected: float) -> None:
    """Within four standard errors: one in 16,000 is beyond."""
    found = [np.average(run.squares[name], weights=run.weights) for run in runs]
    assert abs(np.mean(found) - expected) < 4 * np.std(found, ddof=1) / sqrt(len(found))


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 4, 16])
@pytest.mark.parametrize("other", [True, False], ids=["of another ladder", "of the two sets"])
def test_squared_errors_are_unbiased(count: int, other: bool) -> None:
    """The edge shows half of its pixels grey, at 0.5."""
    scene = renderer.load_scene(edge(WIDE, HIGH))
    runs = [sampled(scene, RANDOM, RANDOM, count, seed) for seed in range(0, 160, 4)]
    assert_mean_squares(runs, (other, count), 0.5**2 * 0.5**2 / count / WIDE)


@pytest.mark.slow
def test_error_of_a_fixed_grid_is_known() -> None:
    """All its pictures are equal: the edge is between the columns of samples, and 0.5 is shown for 0.75."""
    document = edge(WIDE, HIGH)
    document["shapes"][0]["corner"][0] = 0.5 / HIGH
    scene = renderer.load_scene(document)
    runs = [sampled(scene, UNIFORM, RANDOM, 4, seed) for seed in range(0, 48, 4)]
    assert_mean_squares(runs, (True, 4), (0.5 * 0.25) ** 2 / WIDE)


@pytest.mark.parametrize("ladder", [RANDOM, UNIFORM, SOBOL], ids=lambda ladder: ladder.pattern)
def test_few_or_flat_pixels_give_no_accuracy(ladder: Ladder) -> None:
    """One pixel in 256 is on the edge: that none of them was sampled says little."""
    run = sampled(renderer.load_scene(edge(256, 128)), ladder, SOBOL, 4, 0)
    flat = [
        block for block, squares in enumerate(zip(*run.squares.values(), strict=True)) if not any(squares)
    ]
    for blocks in ([0, 1, 2], flat):
        cut = {name: [found[block] for block in blocks] for name, found in run.squares.items()}
        weights = [run.weights[block] for block in blocks]
        part = Sampled(run.sets, run.other, defaultdict(list, cut), weights, 64 * len(blocks))
        for other in (True, False):
            with pytest.raises(UnknownAccuracyError):
                part.accuracy(other=other)


def test_errors_between_and_beyond_counts_follow_the_law() -> None:
    known = Accuracy({count: Interval(*[0.1 / count] * 3) for count in (1, 4, 16)})
    for count in (1, 4, 16):
        assert known.error(count).estimate == pytest.approx(0.1 / count, rel=1e-12)
    errors = [known.error(count) for count in (16, 20, 64, 256)]
    assert [each.estimate for each in errors] == sorted((each.estimate for each in errors), reverse=True)
    widths = [each.high / each.low for each in errors]
    assert widths[0] == 1.0
    assert widths == sorted(widths)
