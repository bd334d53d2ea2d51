"""Errors of fixed qualities, measured in few pixels."""

from __future__ import annotations

from dataclasses import replace
from math import inf, sqrt

import numpy as np
import pytest

import renderer
from accuracy.quotes import places
from accuracy.quotes.accuracies import FEWEST_PIXELS, Accuracy, Sampled, UnknownAccuracyError
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.settings import Ladder, compiled
from renderer.math.intervals import Interval
from renderer.scenes import LoadedScene
from schemas.quality import LightSampling
from tests.accuracy.quotes.conftest import edge

HOUR = Deadline.after(3600.0)
LIGHT = LightSampling(pattern="random", samples=1)
RANDOM, UNIFORM, SOBOL = (Ladder(pattern, LIGHT, "single") for pattern in ("random", "uniform", "sobol"))


def sampled(
    scene: LoadedScene,
    ladder: Ladder,
    last: Ladder,
    counts: tuple[int, ...],
    seed: int,
    ray_seconds: float = 0.0,
) -> Sampled:
    """All pixels that are drawn in the whole picture."""
    plans = {count: compiled(scene, ladder.quality(count), seed + 3) for count in counts}
    halves = (compiled(scene, last.quality(16), seed + 1), compiled(scene, last.quality(16), seed + 2))
    found = Sampled([plans], halves)
    found.run(HOUR, ray_seconds)
    return found


WIDE, HIGH = 4, 1024
"""A picture of which one pixel in four is on the edge."""


def random_squares(count: int) -> float:
    """Mean squared error of the grey edge from so many random samples: half of its pixels are grey."""
    return 0.5**2 * 0.5**2 / count / WIDE


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 4, 16])
@pytest.mark.parametrize("number", [0, 1], ids=["of another ladder", "of the two sets"])
def test_squared_errors_are_right_in_the_mean(count: int, number: int) -> None:
    scene = renderer.load_scene(edge(WIDE, HIGH))
    runs = [sampled(scene, RANDOM, RANDOM, (count,), seed) for seed in range(0, 160, 4)]
    found = [np.average(run.squares[number][count], weights=run.weights) for run in runs]
    deviation = np.std(found, ddof=1) / sqrt(len(found))
    # Four standard errors: of the six cases one in 2,600 runs is beyond.
    assert abs(np.mean(found) - random_squares(count)) < 4 * deviation


def test_the_error_of_a_fixed_grid_is_known_though_all_its_pictures_are_the_same() -> None:
    # The edge passes a quarter of the pixel in, between the columns of samples: 0.5 is shown for 0.75.
    document = edge(WIDE, HIGH)
    document["shapes"][0]["corner"][0] = 0.5 / HIGH
    scene = renderer.load_scene(document)
    found = [sampled(scene, UNIFORM, RANDOM, (4,), seed) for seed in range(0, 160, 4)]
    squares = [np.average(run.squares[0][4], weights=run.weights) for run in found]
    deviation = np.std(squares, ddof=1) / sqrt(len(squares))
    wrong = (0.5 * 0.25) ** 2 / WIDE
    assert abs(np.mean(squares) - wrong) < 4 * deviation


def test_one_pixel_in_sixteen_is_sampled(edge_scene: LoadedScene) -> None:
    run = sampled(edge_scene, RANDOM, RANDOM, (1,), 0)
    assert run.pixels * places.APART**2 == sum(run.weights) == 64 * 32


def test_a_picture_without_error_has_none() -> None:
    scene = renderer.load_scene(edge() | {"shapes": []})
    run = sampled(scene, RANDOM, RANDOM, (1,), 0)
    run.squares = [{count: found * 3 for count, found in ladder.items()} for ladder in run.squares]
    run.weights *= 3
    accuracy = run.accuracy(0)
    assert accuracy.error(64) == Interval(0.0, 0.0, 0.0)
    assert accuracy.count(0.001) == 1


def test_too_few_blocks_give_no_accuracy(edge_scene: LoadedScene) -> None:
    run = sampled(edge_scene, RANDOM, RANDOM, (1,), 0)
    assert len(run.weights) == 1
    for number in (0, 1):
        with pytest.raises(UnknownAccuracyError, match="Only 128 pixels were sampled, too few"):
            run.accuracy(number)


def beginning(run: Sampled, blocks: int) -> Sampled:
    """What a busy machine had time for."""
    cut = [{count: found[:blocks] for count, found in ladder.items()} for ladder in run.squares]
    pixels = blocks * run.pixels // len(run.weights)
    return replace(run, squares=cut, weights=run.weights[:blocks], pixels=pixels)


@pytest.mark.parametrize("ladder", [RANDOM, UNIFORM, SOBOL], ids=lambda ladder: ladder.pattern)
def test_a_pilot_of_few_pixels_does_not_call_an_error_zero(ladder: Ladder) -> None:
    """One pixel in 256 is on the edge: that none of them was sampled says little."""
    run = sampled(renderer.load_scene(edge(256, 128)), ladder, SOBOL, (4,), 0, ray_seconds=1.0)
    assert beginning(run, 8).pixels == 128
    for number in (0, 1):
        with pytest.raises(UnknownAccuracyError, match="Only 128 pixels"):
            beginning(run, 8).accuracy(number)


def test_many_pixels_of_a_part_without_edges_do_not_call_an_error_zero() -> None:
    run = sampled(renderer.load_scene(edge(256, 128)), RANDOM, SOBOL, (4,), 0, ray_seconds=1.0)
    everywhere = [found for ladder in run.squares for found in ladder.values()]
    flat = [block for block, squares in enumerate(zip(*everywhere, strict=True)) if not any(squares)]
    kept = [{count: [found[i] for i in flat] for count, found in ladder.items()} for ladder in run.squares]
    part = replace(run, squares=kept, weights=[run.weights[i] for i in flat], pixels=16 * len(flat))
    assert part.pixels > FEWEST_PIXELS
    for number in (0, 1):
        with pytest.raises(UnknownAccuracyError, match="cannot be distinguished from zero"):
            part.accuracy(number)


def test_counts_whose_squares_come_out_negative_do_not_say_how_large_an_error_is(
    edge_scene: LoadedScene,
) -> None:
    run = sampled(edge_scene, RANDOM, RANDOM, (1, 4), 0)
    run.squares[0] = {1: [0.01, 0.02], 4: [0.001, -0.002]}
    run.weights *= 2
    assert set(run.accuracy(0).known) == {1}
    assert run.accuracy(0).error(4).estimate > 0


EXACT = Accuracy({count: Interval(*[0.1 / count] * 3) for count in (1, 4, 16)}, power=1.0, unsure=0.2)


@pytest.mark.parametrize("count", [1, 4, 9, 16, 100])
def test_errors_between_and_beyond_counts_follow_the_law(count: int) -> None:
    assert EXACT.error(count).estimate == pytest.approx(0.1 / count, rel=1e-12)


def test_errors_are_the_less_sure_the_farther_their_count_is() -> None:
    widths = [EXACT.error(count).high / EXACT.error(count).low for count in (16, 20, 64, 256)]
    assert widths[0] == 1.0
    assert widths == sorted(widths)


@pytest.mark.parametrize("error", [0.02, 0.005, 0.0001])
def test_the_count_for_an_error_has_that_error_or_less(error: float) -> None:
    count = EXACT.count(error)
    assert EXACT.error(count).estimate <= error * (1 + 1e-12)


def test_no_count_brings_down_an_error_that_does_not_fall() -> None:
    stuck = Accuracy({16: Interval(0.1, 0.1, 0.1)}, power=0.0, unsure=0.1)
    assert stuck.count(0.05) == inf
