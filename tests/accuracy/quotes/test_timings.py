"""CPU seconds from blocks, the places that are timed, and the time that is left for them."""

import time

import numpy as np
import pytest

import renderer
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.pilot_pixels import cells, parts
from accuracy.quotes.timings import Stopwatch
from renderer.adaptive.forecast import price
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
    assert Deadline(time.monotonic(), 0.0, time.thread_time() + 3600).left <= 0
    assert OVER.part(0.5).left <= 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_cells_come_once_and_every_beginning_is_spread(seed: int) -> None:
    """Of the first 64 of 256 cells a quarter lies in each quarter of the picture, within 3."""
    found = list(cells(512, 512, 32, seed))
    for x, y in ((0, 0), (256, 0), (0, 256), (256, 256)):
        inside = [cell for cell in found[:64] if x <= cell.x0 < x + 256 and y <= cell.y0 < y + 256]
        assert abs(len(inside) - 16) <= 3
    hits = np.zeros((130, 100), dtype=int)
    for cell in cells(100, 130, 64, seed):
        for part in parts(cell, 16, seed):
            hits[part.y0 : part.y1, part.x0 : part.x1] += 1
    assert (hits == 1).all()


def test_blocks_are_timed_while_there_is_time(ball_scene: LoadedScene) -> None:
    plan = renderer.compile_scene(ball_scene)
    watch = Stopwatch(plan)
    watch.run(OVER)
    assert watch.blocks == 0
    watch.run(HOUR)
    assert {index: sum(rays for _, rays in found) for index, found in watch.found.items()} == {
        pass_.index: 48 * 40 * (pass_.last - pass_.first) for pass_ in plan.passes[1:]
    }
    whole = sum(seconds for found in watch.found.values() for seconds, _ in found)
    assert watch.cpu_seconds(9).estimate == pytest.approx(whole)
    costs = [watch.cpu_seconds(count).estimate for count in (1, 4, 9, 16, 64, 256)]
    assert costs == sorted(costs)


def test_few_blocks_give_wider_intervals(ball_scene: LoadedScene) -> None:
    """One in four, and in all, at 1 and 3 CPU seconds for a thousand rays."""
    plan = renderer.compile_scene(ball_scene)
    block = 48 * 40 // 4
    few = Stopwatch(plan, {1: [(0.001 * block, block)]}).cpu_seconds(1)
    some = Stopwatch(plan, {1: [(0.001 * block, block), (0.003 * block, block)]}).cpu_seconds(1)
    all_ = Stopwatch(plan, {1: [(0.001 * block, block), (0.003 * block, block)] * 2}).cpu_seconds(1)
    assert few.estimate == pytest.approx(1.92)
    assert some.estimate == all_.estimate == pytest.approx(3.84)
    widths = [each.high / each.low for each in (few, some, all_)]
    assert widths == sorted(widths, reverse=True)


def test_price_without_a_pilot_comes_from_the_plan(ball_scene: LoadedScene) -> None:
    """Smaller errors cost more; a limit bounds what all workers do in it."""
    fixed = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="random", samples=5))
    plan = renderer.compile_scene(ball_scene, fixed)
    assert price(plan, 7) == plan.describe().cost

    def cost(error: float, limit: float | None = None, workers: int = 1) -> float:
        quality = TargetQuality(mode="target", error=error, time_limit=limit)
        return price(renderer.compile_scene(ball_scene, quality), workers).cpu_seconds

    assert cost(0.5 / 255) == pytest.approx(2 * cost(1 / 255))
    assert cost(1.0) == cost(0.9) > 0
    free = cost(1e-5)
    assert cost(1e-5, free / 4, workers=2) == pytest.approx(free / 2)
    assert cost(1e-5, free, workers=2) == free
