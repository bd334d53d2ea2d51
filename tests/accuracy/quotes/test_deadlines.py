"""Units of work and the time that is left for them."""

from __future__ import annotations

import time
from functools import partial

from accuracy.quotes.deadlines import Deadline, within

HOUR = 3600.0


def test_all_units_are_done_where_there_is_time() -> None:
    assert list(within(Deadline.after(HOUR), [partial(int, number) for number in (3, 1, 2)])) == [3, 1, 2]


def test_nothing_begins_after_the_end() -> None:
    assert list(within(Deadline.after(-1.0), [partial(int, 1)])) == []


def test_a_unit_that_is_known_to_take_too_long_does_not_begin() -> None:
    assert list(within(Deadline.after(HOUR), [partial(int, 1)], first=2 * HOUR)) == []


def test_units_are_taken_to_last_as_long_as_the_longest_so_far() -> None:
    begun = []

    def unit(seconds: float) -> None:
        begun.append(seconds)
        busy(seconds)

    # After the first unit less than its own time is left, however slow the machine is.
    list(within(Deadline.after(0.15), [partial(unit, 0.1), partial(unit, 0.0)]))
    assert begun == [0.1]


def test_deadline_counts_cpu_seconds_and_not_the_work_of_others() -> None:
    """Waiting takes none of it, up to a limit by the clock."""
    deadline = Deadline.after(10.0)
    time.sleep(0.3)
    assert deadline.left > 9.9
    busy(0.3)
    assert deadline.left <= 9.7
    assert Deadline(end=time.thread_time() + HOUR, latest=time.monotonic()).left <= 0


def busy(seconds: float) -> None:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def test_a_part_of_no_time_ends_at_once() -> None:
    assert Deadline.after(-5.0).part(0.5).left <= 0
