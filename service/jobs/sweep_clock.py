"""Detection of jumps of the wall clock: a wrong clock must not make everything look old."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime, timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.lifecycle import clock, damage, totals
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, JobRow

MOST_CORRECTION = timedelta(hours=1)
"""Corrections of a clock are smaller."""
MOST_DOWNTIME = timedelta(days=1)
"""After a longer downtime the clock is not trusted at the start."""
# Of Linux's monotonic clocks, only this one counts the time of suspension.
STEADY_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


def _steady() -> float:
    return time.clock_gettime(STEADY_CLOCK)


class SweepClock:
    """Compares the wall clock with a monotonic one, and after a start with the last time in the database.

    Parameters
    ----------
    wall, steady
        The clocks; the steady one counts seconds from some beginning.
    """

    def __init__(
        self,
        database: Database,
        wall: Callable[[], datetime] = clock.wall,
        steady: Callable[[], float] = _steady,
    ) -> None:
        self._database, self._wall, self._steady = database, wall, steady
        self._trusted = wall(), steady()

    def start(self) -> None:
        """Read the last time in the database, before a wrong clock writes to it."""
        with self._database.reading() as session:
            swept = totals.read(session, totals.SWEPT_AT)
            seen = swept or _newest(session)
        if seen and not swept:
            with self._database.writing() as session:
                totals.put(session, totals.SWEPT_AT, seen)
        before = datetime.fromtimestamp(seen, UTC) + MOST_DOWNTIME if seen else self._wall()
        self._trusted = before, self._steady()

    def jump(self) -> timedelta:
        """Seconds that the wall clock has gained on elapsed time since it was trusted last.

        It is 0 if the clocks differ by at most a correction.
        """
        before, then = self._trusted
        ahead = self._wall() - before - timedelta(seconds=self._steady() - then)
        return ahead if ahead > MOST_CORRECTION else timedelta()

    def trust(self) -> None:
        """Trust the wall clock from now on."""
        now = self._wall()
        self._trusted = now, self._steady()
        with self._database.writing() as session:
            totals.put(session, totals.SWEPT_AT, int(now.timestamp()))


def _newest(session: Session) -> int:
    """Find when something was submitted or uploaded last, as no sweep was noted; 0 in an empty database."""
    newest = []
    for time_of in (JobRow.created_at, AssetRow.used_at):
        # One that is damaged says nothing.
        with suppress(*damage.ROW_ERRORS):
            newest.append(session.scalar(select(func.max(time_of))))
    return max((int(at.timestamp()) for at in newest if at is not None), default=0)
