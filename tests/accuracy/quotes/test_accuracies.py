"""Errors of fixed qualities, measured in few pixels."""

from __future__ import annotations

from dataclasses import replace
from math import inf, sqrt

import numpy as np
import pytest

import renderer
from accuracy.quotes.accuracies import Accuracy, Sampled, UnknownAccuracyError
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.settings import Ladder, compiled
from renderer.math.intervals import Interval
from renderer.scenes import LoadedScene
from schemas.quality import LightSampling
from tests.accuracy.quotes.conftest import edge

LIGHT = LightSampling(pattern="random", samples=1)
RANDOM, UNIFORM, SOBOL = (Ladder(pattern, LIGHT, "single") for pattern in ("random", "uniform", "sobol"))
WIDE, HIGH = 4, 1024
"""A picture of which one pixel in four is on the edge."""


def sampled(
    scene: LoadedScene, ladder: Ladder, last: Ladder, counts: tuple[int, ...], seed: int, ray: float = 0.0
) -> Sampled:
    """One pixel in sixteen of the whole picture."""
    plans = {count: compiled(scene, ladder.quality(count), seed + 3) for count in counts}
    halves = (compiled(scene, last.quality(16), seed + half) for half in (1, 2))
    found = Sampled([plans], (next(halves), next(halves)))
    found.run(Deadline.after(3600.0), ray)
    return found


def assert_mean_squares(runs: list[Sampled], number: int, count: int, expected: float) -> None:
    """Within four standard errors: one in 16,000 is beyond."""
    found = [np.average(run.squares[number][count], weights=run.weights) for run in runs]
    assert abs(np.mean(found) - expected) < 4 * np.std(found, ddof=1) / sqrt(len(found))


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 4, 16])
@pytest.mark.parametrize("number", [0, 1], ids=["of another ladder", "of the two sets"])
def test_squared_errors_are_unbiased(count: int, number: int) -> None:
    """The edge shows half of its pixels grey, at 0.5."""
    scene = renderer.load_scene(edge(WIDE, HIGH))
    runs = [sampled(scene, RANDOM, RANDOM, (count,), seed) for seed in range(0, 160, 4)]
    assert_mean_squares(runs, number, count, 0.5**2 * 0.5**2 / count / WIDE)


@pytest.mark.slow
def test_error_of_a_fixed_grid_is_known() -> None:
    """All its pictures are equal: the edge is between the columns of samples, and 0.5 is shown for 0.75."""
    document = edge(WIDE, HIGH)
    document["shapes"][0]["corner"][0] = 0.5 / HIGH
    scene = renderer.load_scene(document)
    runs = [sampled(scene, UNIFORM, RANDOM, (4,), seed) for seed in range(0, 48, 4)]
    assert_mean_squares(runs, 0, 4, (0.5 * 0.25) ** 2 / WIDE)


@pytest.mark.parametrize("ladder", [RANDOM, UNIFORM, SOBOL], ids=lambda ladder: ladder.pattern)
def test_few_or_flat_pixels_give_no_accuracy(ladder: Ladder) -> None:
    """One pixel in 256 is on the edge: that none of them was sampled says little."""
    run = sampled(renderer.load_scene(edge(256, 128)), ladder, SOBOL, (4,), 0, ray=1.0)
    everywhere = [found for each in run.squares for found in each.values()]
    flat = [block for block, squares in enumerate(zip(*everywhere, strict=True)) if not any(squares)]
    for blocks in (list(range(8)), flat):
        cut = [{count: [found[i] for i in blocks] for count, found in each.items()} for each in run.squares]
        part = replace(run, squares=cut, weights=[run.weights[i] for i in blocks], pixels=16 * len(blocks))
        for number in (0, 1):
            with pytest.raises(UnknownAccuracyError):
                part.accuracy(number)


def test_errors_between_and_beyond_counts_follow_the_law() -> None:
    exact = Accuracy({count: Interval(*[0.1 / count] * 3) for count in (1, 4, 16)}, power=1.0, unsure=0.2)
    for count in (1, 4, 9, 16, 100):
        assert exact.error(count).estimate == pytest.approx(0.1 / count, rel=1e-12)
    widths = [exact.error(count).high / exact.error(count).low for count in (16, 20, 64, 256)]
    assert widths[0] == 1.0
    assert widths == sorted(widths)
    for error in (0.02, 0.005, 0.0001):
        assert exact.error(exact.count(error)).estimate <= error * (1 + 1e-12)
    stuck = Accuracy({16: Interval(0.1, 0.1, 0.1)}, power=0.0, unsure=0.1)
    assert stuck.count(0.05) == inf
