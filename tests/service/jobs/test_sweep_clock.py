"""Jumps of the wall clock, as sweeps find them."""

from datetime import UTC, datetime, timedelta

import pytest

from service.jobs.sweep_clock import SweepClock
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow
from tests.service.support import BOTH

NOON = datetime(2026, 3, 29, 12, tzinfo=UTC)
YEARS = timedelta(days=3652)


class Clocks:
    """A wall clock that can be set, and one that cannot; a start is one more clock of the database."""

    def __init__(self, database: Database) -> None:
        self.wall, self.steady, self._database = NOON, 1000.0, database
        self.start()

    def start(self) -> None:
        self.clock = SweepClock(self._database, lambda: self.wall, lambda: self.steady)
        self.clock.start()

    def wait(self, span: timedelta) -> None:
        self.wall += span
        self.steady += span.total_seconds()


@BOTH
def test_jump_is_found_until_the_clock_is_right_or_trusted(database: Database) -> None:
    clocks = Clocks(database)
    clocks.clock.trust()
    # A service that runs for years believes its clock.
    clocks.wait(YEARS)
    assert clocks.clock.jump() == timedelta()
    clocks.clock.trust()
    clocks.wall += YEARS
    clocks.wait(timedelta(minutes=1))
    assert clocks.clock.jump() == YEARS
    clocks.wall -= YEARS
    assert clocks.clock.jump() == timedelta()
    clocks.wall += YEARS
    clocks.clock.trust()
    clocks.wait(timedelta(minutes=1))
    assert clocks.clock.jump() == timedelta()


@pytest.mark.parametrize("span", [timedelta(minutes=10), timedelta(hours=-3), -YEARS], ids=str)
def test_correction_is_no_jump(database: Database, span: timedelta) -> None:
    clocks = Clocks(database)
    clocks.clock.trust()
    clocks.wall += span
    assert clocks.clock.jump() == timedelta()


@BOTH
def test_jump_is_found_across_a_restart(database: Database) -> None:
    clocks = Clocks(database)
    assert clocks.clock.jump() == timedelta()
    clocks.clock.trust()
    for downtime, is_jump in ((timedelta(hours=12), False), (YEARS, True), (timedelta(), True)):
        clocks.wall += downtime
        clocks.start()
        assert (clocks.clock.jump() > timedelta()) is is_jump


@BOTH
def test_time_of_an_upload_counts_until_something_is_swept(database: Database) -> None:
    size = {"bytes": 1, "media_type": "image/png", "width": 1, "height": 1}
    with database.writing() as session:
        session.add(AssetRow(sha256="0" * 64, created_at=NOON, used_at=NOON, **size))
    clocks = Clocks(database)
    clocks.wall += YEARS
    clocks.start()
    assert clocks.clock.jump() > timedelta()
    # What comes in under a wrong clock does not make it right.
    with database.writing() as session:
        session.add(AssetRow(sha256="1" * 64, created_at=clocks.wall, used_at=clocks.wall, **size))
    clocks.start()
    assert clocks.clock.jump() > timedelta()
