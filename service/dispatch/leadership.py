"""Leader election: which of the servers on one database hands out work.

The leader's lease is kept in the database and counted by its clock: the leader renews it with what it writes,
and once it is late, another server may lead. In each of its transactions the leader checks that it still
leads, and of those one writes at a time: a server that was stopped, or cut off, for a while writes nothing as
a leader once another leads. Where a database has one server alone, that one leads.

The renewals are the service's signs of life: the time between two of them is known after a crash, too.
"""

from __future__ import annotations

import secrets
from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.lifecycle import clock
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow

# Silence after which another server leads, seconds.
LEASE_SECONDS = 3.0
# How often the leader renews its lease, and the others look whether it is up, seconds.
BEAT_SECONDS = 0.5

_LEASE = timedelta(seconds=LEASE_SECONDS)
_STANDING = select(LeaderRow, func.clock_timestamp()).with_for_update(of=LeaderRow)
ALONE = 1
"""The term of a server that has its database for itself."""


class Term(NamedTuple):
    """The number of a term, and the seconds since the last sign of life, 0 where none was due."""

    number: int
    silent_seconds: float = 0.0


class Leadership:
    """The part of one server in it. Every method works in a transaction of its caller, one that writes.

    Parameters
    ----------
    database : Database
        Whether it is shared decides whether there is anything to look after.
    """

    def __init__(self, database: Database) -> None:
        self._shared = database.shared
        self._server = secrets.token_hex(8)

    def stand(self, session: Session) -> Term | None:
        """Lead, if no other server does, and give a sign of life.

        Returns
        -------
        Term or None
            It has another number whenever a server has begun to lead; None if another leads.
        """
        if not self._shared:
            row = session.scalars(select(LeaderRow)).one()
            return Term(ALONE, _renew(row, clock.since(row.expires_at - _LEASE), clock.now()))
        row, now = session.execute(_STANDING).one()
        silent = (now - row.expires_at + _LEASE).total_seconds()
        if row.server == self._server:
            return Term(row.term, _renew(row, silent, now))
        if row.server is not None and row.expires_at > now:
            return None
        row.server, row.term, row.expires_at = self._server, row.term + 1, now + _LEASE
        return Term(row.term, max(0.0, silent))

    def resign(self, session: Session) -> None:
        """Let another server lead at once, if this one does."""
        if self._shared:
            row, _ = session.execute(_STANDING).one()
            if row.server == self._server:
                row.server = None


def _renew(row: LeaderRow, silent_seconds: float, now: datetime) -> float:
    """Renew the lease if it is due; return for how long it was not renewed."""
    if silent_seconds < BEAT_SECONDS:
        return 0.0
    row.expires_at = now + _LEASE
    return silent_seconds
