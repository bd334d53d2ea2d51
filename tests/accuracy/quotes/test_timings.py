"""CPU seconds from blocks, the places that are timed, and the time that is left for them."""

from __future__ import annotations

import time

import numpy as np
import pytest

import renderer
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.places import cells, spread
from accuracy.quotes.prices import price
from accuracy.quotes.settings import compiled, sobol_ladder
from accuracy.quotes.timings import Stopwatch
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, FixedQuality, TargetQuality

HOUR, OVER = Deadline.after(3600.0), Deadline.after(-1.0)


def busy(seconds: float) -> None:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def test_deadline_counts_cpu_seconds_alone() -> None:
    """Waiting takes none of it, up to a limit by the clock."""
    deadline = Deadline.after(10.0)
    time.sleep(0.2)
    assert deadline.left > 9.9
    busy(0.2)
    assert deadline.left <= 9.8
    assert Deadline(end=time.thread_time() + 3600, latest=time.monotonic()).left <= 0
    assert OVER.part(0.5).left <= 0


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (8, 8), (5, 3), (1, 7), (16, 16)])
def test_cells_come_once_and_spread_evenly(columns: int, rows: int) -> None:
    """Of the first 4**n cells of a square one is in each coarse square, at the same place in it."""
    order = spread(columns, rows, seed=3)
    assert sorted(order) == [(x, y) for x in range(columns) for y in range(rows)]
    for coarse in (2, 4, 8) if columns == 16 else ():
        first = order[: coarse * coarse]
        assert len({(x % (16 // coarse), y % (16 // coarse)) for x, y in first}) == 1
    hits = np.zeros((130, 100), dtype=int)
    for cell in cells(100, 130, 32, seed=columns):
        hits[cell.y0 : cell.y1, cell.x0 : cell.x1] += 1
    assert (hits == 1).all()


@pytest.fixture
def watch(ball_scene: LoadedScene) -> Stopwatch:
    return Stopwatch(
        [renderer.compile_scene(ball_scene), compiled(ball_scene, sobol_ladder("single").quality(16))]
    )


def test_blocks_are_timed_while_there_is_time(watch: Stopwatch, ball_scene: LoadedScene) -> None:
    watch.run(OVER, OVER)
    assert watch.timing(0) is watch.timing(1) is watch.timing(2) is None
    watch.run(HOUR, HOUR)
    assert sum(pixels for _, pixels in watch.firsts) == 48 * 40
    found = [watch.timing(number) for number in (0, 1)]
    assert all(
        each is not None and 0 < each.later.low <= each.later.estimate <= each.later.high for each in found
    )
    assert found[0] is not None
    whole = pytest.approx(sum(seconds for seconds, _ in watch.firsts))
    assert found[0].first.low == found[0].first.high == whole
    single = Stopwatch([compiled(ball_scene, sobol_ladder("single").quality(1))])
    single.run(HOUR, HOUR)
    timing = single.timing(0)
    assert timing is not None
    assert timing.later.estimate == timing.first.estimate


@pytest.mark.parametrize(
    ("firsts", "number", "pair", "first", "later"),
    [
        ([(4.0, 400), (1.0, 100)], 0, (0.01, 0.01, 0.02), 0.01, 0.02),
        ([(2.0, 48 * 40)], 0, None, 2 / 48 / 40, 2 / 48 / 40),
        ([(1.0, 100), (3.0, 100)], 1, (0.01, 0.005, 0.0025), 0.01, 0.005),
    ],
    ids=["cells at edges are smaller", "later samples as the first", "second ladder relative to the first"],
)
def test_seconds_of_blocks_give_those_of_the_picture(
    watch: Stopwatch, firsts: list[tuple[float, int]], number: int, pair: tuple[float, float, float] | None,
    first: float, later: float,
) -> None:  # fmt: skip
    watch.firsts = firsts
    watch.pairs[number] = [pair] if pair else []
    timing = watch.timing(number)
    assert timing is not None
    assert timing.first.estimate == pytest.approx(first * 48 * 40)
    assert timing.later.estimate == pytest.approx(later * 48 * 40)
    assert pair is not None or timing.later.low < timing.later.estimate < timing.later.high


def test_price_without_a_pilot_is_that_of_the_samples(ball_scene: LoadedScene) -> None:
    """An error of a step of 8 bits costs four samples; a limit bounds what all workers do in it."""
    fixed = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="random", samples=5))
    plan = renderer.compile_scene(ball_scene, fixed)
    assert price(plan, 7) == plan.describe().cost
    step = renderer.compile_scene(ball_scene, TargetQuality(error=1 / 255))
    assert price(step, 1).camera_rays == 4 * 48 * 40

    def cost(error: float, limit: float | None = None, workers: int = 1) -> float:
        quality = TargetQuality(mode="target", error=error, time_limit=limit)
        return price(renderer.compile_scene(ball_scene, quality), workers).cpu_seconds

    assert cost(0.5 / 255) == pytest.approx(2 * cost(1 / 255))
    assert cost(1.0) == cost(0.5) > 0
    free = cost(1e-5)
    assert cost(1e-5, free / 4, workers=2) == pytest.approx(free / 2)
    assert cost(1e-5, free, workers=2) == free
