"""Elapsed time while the wall clock is set."""

from datetime import UTC, datetime, timedelta

import pytest

from service.lifecycle.clock import Clock

NOON = datetime(2026, 3, 29, 12, tzinfo=UTC)


class Clocks:
    """A wall clock that can be set, and one that cannot."""

    def __init__(self) -> None:
        self.wall, self.steady = NOON, 1000.0
        self.clock = Clock(lambda: self.wall, lambda: self.steady)

    def wait(self, seconds: float) -> None:
        self.wall += timedelta(seconds=seconds)
        self.steady += seconds


@pytest.mark.parametrize("step", [timedelta(hours=1), timedelta(hours=-1), timedelta(days=-400)], ids=str)
def test_clock_that_is_set_changes_no_elapsed_time(step: timedelta) -> None:
    clocks = Clocks()
    begun = clocks.clock.now()
    clocks.wait(10)
    clocks.wall += step
    clocks.wait(5)
    assert clocks.clock.since(begun) == 15.0


@pytest.mark.parametrize(("moment", "elapsed"), [(-30, 30.0), (3600, 0.0)], ids=["past", "future"])
def test_clock_after_a_restart_starts_from_the_wall(moment: float, elapsed: float) -> None:
    """A moment in the future counts as now."""
    clocks = Clocks()
    begun = NOON + timedelta(seconds=moment)
    assert clocks.clock.since(begun) == elapsed
    clocks.wait(2)
    assert clocks.clock.since(begun) == elapsed + 2.0
