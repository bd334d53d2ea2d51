"""Leader election: which of the servers on one database hands out work.

The leader's lease is kept in the database and counted by its clock: the leader renews it with what it writes,
and once it is late, another server may lead. In each of its transactions the leader checks that it still
leads, and of those one writes at a time: a server that was stopped, or cut off, for a while writes nothing as
a leader once another leads. Where a database has one server alone, that one leads.
"""

from __future__ import annotations

import secrets
from datetime import timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow

# Silence after which another server leads, seconds.
LEASE_SECONDS = 3.0
# How often the leader renews its lease, and the others look whether it is up, seconds.
BEAT_SECONDS = 0.5

_LEASE, _RENEWED = timedelta(seconds=LEASE_SECONDS), timedelta(seconds=LEASE_SECONDS - BEAT_SECONDS)
_STANDING = select(LeaderRow, func.clock_timestamp()).with_for_update(of=LeaderRow)
ALONE = 1
"""The term of a server that has its database for itself."""


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

    def stand(self, session: Session) -> int | None:
        """Lead, if no other server does.

        Returns
        -------
        int or None
            Number of the term, another one whenever a server has begun to lead; None if another leads.
        """
        if not self._shared:
            return ALONE
        row, now = session.execute(_STANDING).one()
        if row.server != self._server:
            if row.server is not None and row.expires_at > now:
                return None
            row.server, row.term = self._server, row.term + 1
            row.expires_at = now + _LEASE
        elif row.expires_at < now + _RENEWED:
            row.expires_at = now + _LEASE
        return int(row.term)

    def resign(self, session: Session) -> None:
        """Let another server lead at once, if this one does."""
        if self._shared:
            row, _ = session.execute(_STANDING).one()
            if row.server == self._server:
                row.server = None
