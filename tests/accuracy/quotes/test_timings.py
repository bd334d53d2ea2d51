"""CPU seconds from blocks."""

from __future__ import annotations

import pytest

import renderer
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.settings import compiled, sobol_ladder
from accuracy.quotes.timings import Stopwatch, Timing
from renderer.math.intervals import Interval
from renderer.scenes import LoadedScene

HOUR = Deadline.after(3600.0)
NOW = Deadline.after(-1.0)


@pytest.fixture
def watch(ball_scene: LoadedScene) -> Stopwatch:
    other = compiled(ball_scene, sobol_ladder("single").quality(16))
    return Stopwatch([renderer.compile_scene(ball_scene), other])


def test_all_blocks_are_timed_where_there_is_time(watch: Stopwatch) -> None:
    watch.run(HOUR, HOUR)
    assert sum(pixels for _, pixels in watch.firsts) == 48 * 40
    for number in (0, 1):
        timing = watch.timing(number)
        assert timing is not None
        assert 0 < timing.later.low <= timing.later.estimate <= timing.later.high
    first = watch.timing(0)
    assert first is not None
    assert first.first.low == first.first.high == pytest.approx(sum(seconds for seconds, _ in watch.firsts))


def test_nothing_is_estimated_of_what_was_not_timed(watch: Stopwatch) -> None:
    watch.run(NOW, NOW)
    assert watch.timing(0) is watch.timing(1) is watch.timing(2) is None


def test_costs_are_those_of_the_picture_though_cells_at_its_edges_are_smaller(watch: Stopwatch) -> None:
    watch.firsts = [(4.0, 400), (1.0, 100)]
    watch.pairs[0] = [(0.01, 0.01, 0.02)]
    timing = watch.timing(0)
    assert timing is not None
    assert timing.first.estimate == pytest.approx(0.01 * 48 * 40)
    assert timing.later.estimate == pytest.approx(0.02 * 48 * 40)


def test_until_one_is_timed_later_samples_cost_what_the_first_one_does(watch: Stopwatch) -> None:
    watch.firsts = [(2.0, 48 * 40)]
    timing = watch.timing(0)
    assert timing is not None
    assert timing.first == Interval(2.0, 2.0, 2.0)
    assert timing.later.estimate == 2.0
    assert timing.later.low < 2.0 < timing.later.high
    assert watch.timing(1) is None


def test_a_second_ladder_is_timed_relative_to_the_first(watch: Stopwatch) -> None:
    # Its blocks cost half as much where both were timed, and cheap ones were there.
    watch.firsts = [(1.0, 100), (3.0, 100)]
    watch.pairs[1] = [(0.01, 0.005, 0.0025)]
    timing = watch.timing(1)
    assert timing is not None
    assert timing.first.estimate == pytest.approx(0.02 * 48 * 40 / 2)
    assert timing.later.estimate == pytest.approx(0.02 * 48 * 40 / 4)


def test_each_further_sample_costs_the_same() -> None:
    timing = Timing(Interval(3.0, 2.0, 5.0), Interval(2.0, 1.0, 3.0))
    assert [timing.cpu_seconds(count).estimate for count in (1, 4, 16)] == [3.0, 9.0, 33.0]
    one = timing.cpu_seconds(1)
    assert one.low < 2.0
    assert one.high > 5.0


def test_pictures_of_one_sample_are_timed(ball_scene: LoadedScene) -> None:
    plan = compiled(ball_scene, sobol_ladder("single").quality(1))
    watch = Stopwatch([plan])
    watch.run(HOUR, HOUR)
    timing = watch.timing(0)
    assert timing is not None
    assert timing.later.estimate == timing.first.estimate
