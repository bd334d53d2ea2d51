"""Sums over all stored rows, updated with each change: adding them up would slow down as rows accumulate.

As in ``ledger.py`` every function works in a transaction of its caller, of which one writes at a time.
"""

from __future__ import annotations

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.storage.database.models import TotalRow

STORED_BYTES = "stored_bytes"
"""The bytes of all finished pictures."""
SWEPT_AT = "swept_at"
"""Time of the last sweep, seconds since the epoch; not a sum."""
_FAILED = "failed:"


def add(session: Session, name: str, amount: int) -> None:
    """Change a sum by an amount, which may be negative."""
    changed = update(TotalRow).where(TotalRow.name == name).values(amount=TotalRow.amount + amount)
    if amount and not session.execute(changed.returning(TotalRow.name)).all():
        session.add(TotalRow(name=name, amount=amount))
        session.flush()


def put(session: Session, name: str, amount: int) -> None:
    """Replace an amount."""
    session.merge(TotalRow(name=name, amount=amount))


def read(session: Session, name: str) -> int:
    """Return a sum; 0 where nothing was added to it."""
    return session.scalar(select(TotalRow.amount).where(TotalRow.name == name)) or 0


def add_failed(session: Session, code: str, jobs: int) -> None:
    """Change the number of failed jobs with a code."""
    add(session, f"{_FAILED}{code}", jobs)


def failed(session: Session) -> dict[str, int]:
    """Count the failed jobs that are kept, by their codes."""
    counted = TotalRow.name.startswith(_FAILED), TotalRow.amount > 0
    found = session.execute(select(TotalRow.name, TotalRow.amount).where(*counted))
    return {name.removeprefix(_FAILED): count for name, count in found}
