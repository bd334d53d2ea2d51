"""Time limits while the wall clock changes."""

from datetime import UTC, datetime, timedelta

import pytest

from service.lifecycle.clock import Clock

NOON = datetime(2026, 3, 29, 12, tzinfo=UTC)


class Clocks:
    """A wall clock that can be set, and one that cannot."""

    def __init__(self) -> None:
        self.wall, self.steady = NOON, 1000.0
        self.clock = Clock(lambda: self.wall, lambda: self.steady)

    def pass_(self, seconds: float) -> None:
        self.wall += timedelta(seconds=seconds)
        self.steady += seconds


@pytest.mark.parametrize("step", [timedelta(hours=1), timedelta(hours=-1), timedelta(days=-400)], ids=str)
def test_setting_the_wall_clock_changes_nothing_about_what_has_passed(step: timedelta) -> None:
    clocks = Clocks()
    begun = clocks.clock.now()
    clocks.pass_(10)
    clocks.wall += step
    clocks.pass_(5)
    assert clocks.clock.since(begun) == 15.0


def test_after_a_restart_the_wall_clock_says_what_has_passed() -> None:
    clocks = Clocks()
    assert clocks.clock.since(NOON - timedelta(seconds=30)) == 30.0
    clocks.pass_(1)
    assert clocks.clock.since(NOON - timedelta(seconds=30)) == 31.0


def test_a_time_in_the_future_counts_as_now() -> None:
    clocks = Clocks()
    assert clocks.clock.since(NOON + timedelta(hours=1)) == 0.0
    clocks.pass_(2)
    assert clocks.clock.since(NOON + timedelta(hours=1)) == 2.0
