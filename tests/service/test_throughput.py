"""How fast a service says it works: what it did while it had work, and not while it had none."""

from __future__ import annotations

import pytest

from service.dispatch.throughput import Throughput


class Clock:
    """Seconds that a test lets pass."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def work(pace: Throughput, clock: Clock, seconds: int, rate: float) -> None:
    """Let a service work for some seconds, and then have nothing to do."""
    pace.watch(busy=True)
    for _ in range(seconds):
        clock.now += 1.0
        pace.note(rate)
    pace.watch(busy=False)


def test_a_service_that_has_done_nothing_works_as_fast_as_its_workers_can(clock: Clock) -> None:
    pace = Throughput(4, clock)
    clock.now += 720.0
    assert pace.rate() == 4.0


@pytest.mark.parametrize("idle", [1.0, 60.0, 720.0, 1e6])
def test_idle_time_is_no_slowness(clock: Clock, idle: float) -> None:
    pace = Throughput(4, clock)
    work(pace, clock, 120, 3.0)
    before = pace.rate()
    clock.now += idle
    assert pace.rate() == before == pytest.approx(3.0, rel=0.02)


def test_a_service_whose_workers_have_work_and_finish_none_gets_slow(clock: Clock) -> None:
    pace = Throughput(4, clock)
    work(pace, clock, 120, 3.0)
    pace.watch(busy=True)
    clock.now += 300.0
    assert pace.rate() < 0.2


def test_what_was_rendered_long_ago_is_forgotten(clock: Clock) -> None:
    pace = Throughput(4, clock)
    work(pace, clock, 300, 4.0)
    work(pace, clock, 300, 1.0)
    assert pace.rate() == pytest.approx(1.0, rel=0.1)
