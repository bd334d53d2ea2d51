"""Leader election: which of the servers on one database hands out work.

The leader's lease is in the database and timed by its clock. The leader renews it with its writes; once it
has expired, another server may lead. Each transaction of the leader checks that it still leads, and writing
transactions exclude each other, so a server that was suspended or cut off writes nothing once another leads.
A server that does not share its database always leads.

The renewals are the service's signs of life: the time between two of them is known after a crash, too.
"""

from __future__ import annotations

import secrets
import time
from datetime import datetime, timedelta
from typing import NamedTuple

import structlog
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from service.lifecycle import clock
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow

# Seconds of silence after which another server leads.
LEASE_SECONDS = 3.0
# How often the leader renews its lease, and the others look whether it is up, seconds.
BEAT_SECONDS = 0.5

_LEASE = timedelta(seconds=LEASE_SECONDS)
_STANDING = select(LeaderRow, func.clock_timestamp()).with_for_update(of=LeaderRow)
SOLE_TERM = 1
"""The term of a server that has its database for itself."""

log = structlog.get_logger()


class Term(NamedTuple):
    """The number of a term, and the seconds since the last sign of life, 0 where none was due."""

    number: int
    silent_seconds: float = 0.0


class Leadership:
    """The part of one server in it.

    Parameters
    ----------
    database : Database
        Whether it is shared decides whether there is anything to look after.

    Attributes
    ----------
    term : int or None
        The term in which this server leads, as far as it knows.
    """

    def __init__(self, database: Database) -> None:
        self._database, self._shared = database, database.shared
        self._server = secrets.token_hex(8)
        self.term: int | None = None
        self._next_stand = 0.0

    def is_due(self) -> bool:
        """Whether to stand for election: always, or now and then while another server leads."""
        if self.term is None:
            if time.monotonic() < self._next_stand:
                return False
            self._next_stand = time.monotonic() + BEAT_SECONDS
        return True

    def stand(self, session: Session) -> Term | None:
        """Lead, if no other server does, and give a sign of life, in a transaction that writes.

        Returns
        -------
        Term or None
            It has another number whenever a server has begun to lead; None if another leads.
        """
        if not self._shared:
            row = session.scalars(select(LeaderRow)).one()
            return Term(SOLE_TERM, _renew(row, clock.since(row.expires_at - _LEASE), clock.now()))
        row, now = session.execute(_STANDING).one()
        silent = (now - row.expires_at + _LEASE).total_seconds()
        if row.server == self._server:
            return Term(row.term, _renew(row, silent, now))
        if row.server is not None and row.expires_at > now:
            return None
        row.server, row.term, row.expires_at = self._server, row.term + 1, now + _LEASE
        return Term(row.term, max(0.0, silent))

    def enter(self, term: int | None) -> bool:
        """Note the term that the database has committed; False if it is the one before."""
        before, self.term = self.term, term
        if term == before:
            return False
        if term is None:
            log.warning("lost leadership", term=before)
        elif self._shared:
            log.info("became leader", term=term)
        return True

    def forget(self) -> None:
        """Stand again at once, as a server that has just started."""
        self.term, self._next_stand = None, 0.0

    def resign(self) -> None:
        """Let another server lead at once, if this one does."""
        if not self._shared:
            return
        try:
            with self._database.writing() as session:
                row, _ = session.execute(_STANDING).one()
                if row.server == self._server:
                    row.server = None
                self._database.notify(session, anything=True)
        except SQLAlchemyError as error:
            log.warning("could not release leadership; the lease will expire", error=type(error).__name__)


def _renew(row: LeaderRow, silent_seconds: float, now: datetime) -> float:
    """Renew the lease if it is due; return for how long it was not renewed."""
    if silent_seconds < BEAT_SECONDS:
        return 0.0
    row.expires_at = now + _LEASE
    return silent_seconds
