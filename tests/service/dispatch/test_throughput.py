"""Throughput of a service: idle time does not count."""

import pytest

from service.dispatch.throughput import Throughput


class Paced(Throughput):
    """Four workers, and a clock that a test moves."""

    def __init__(self) -> None:
        self.time = 1000.0
        super().__init__(4, lambda: self.time)

    def work(self, seconds: int, rate: float) -> None:
        """Work for some seconds, and then have nothing to do."""
        self.watch(busy=True)
        for _ in range(seconds):
            self.time += 1.0
            self.note(rate)
        self.watch(busy=False)


@pytest.fixture
def pace() -> Paced:
    return Paced()


def test_new_service_works_as_fast_as_its_workers_can(pace: Paced) -> None:
    pace.time += 720.0
    assert pace.rate() == 4.0


@pytest.mark.parametrize("idle", [1.0, 720.0, 1e6])
def test_idle_time_is_not_slow(pace: Paced, idle: float) -> None:
    pace.work(120, 3.0)
    before = pace.rate()
    pace.time += idle
    assert pace.rate() == before == pytest.approx(3.0, rel=0.02)


def test_busy_time_without_results_is_slow(pace: Paced) -> None:
    pace.work(120, 3.0)
    pace.watch(busy=True)
    pace.time += 300.0
    assert pace.rate() < 0.2
