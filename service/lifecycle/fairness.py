"""Whose turn it is: users share the workers by the CPU seconds that were rendered for them.

Start-time fair queueing. Each user has a clock, `served`: the CPU seconds charged to the user. The next tile
is of the active user whose clock is behind all others. A tile is charged when it is handed out, at the price
that is expected, and put right when it is finished. A user who comes back after a pause starts from the
present (`turn`, the clock of whoever was served last): a pause is no credit. So a new user waits for no more
than the tiles that are handed out already, however much another has waiting.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from service.storage.database.models import JobRow, RenderRow, ShareRow, TileRow

_NEXT = (
    select(ShareRow)
    .where(ShareRow.active, ShareRow.owner.not_in(bindparam("resting", expanding=True)))
    .order_by(ShareRow.served, ShareRow.owner)
    .limit(2)
)
_NOW = select(func.max(ShareRow.turn))


def activate(session: Session, owners: Iterable[str]) -> None:
    """Let users take part who have something that waits."""
    for owner in owners:
        share = session.get(ShareRow, owner)
        if share is None:
            now = session.scalar(_NOW) or 0.0
            session.add(ShareRow(owner=owner, served=now, turn=now, active=True))
        elif not share.active:
            share.active = True
            share.served = max(share.served, session.scalar(_NOW) or 0.0)


def activate_all_of(session: Session, render: RenderRow) -> None:
    """Let the users take part whose jobs share a render of which steps wait."""
    sharing = JobRow.render_number == render.number, JobRow.finished_at.is_(None)
    activate(session, session.scalars(select(JobRow.owner).where(*sharing).distinct()).all())


def next_share(session: Session, resting: Collection[str]) -> tuple[ShareRow | None, float]:
    """Give the user whose turn it is, those who rest left out, and the clock up to which it is."""
    first, second = [*session.scalars(_NEXT, {"resting": list(resting)}).all(), None, None][:2]
    return first, second.served if second else float("inf")


def charge(share: ShareRow, step: TileRow, cpu_seconds: float) -> None:
    """Charge a user with what a step is expected to cost."""
    share.turn = share.served
    share.served += cpu_seconds
    step.payer, step.charge = share.owner, cpu_seconds


def settle(session: Session, step: TileRow, cpu_seconds: float) -> None:
    """Put the charge of a step right: to what it has cost, or to nothing if it is to be done again."""
    share = session.get(ShareRow, step.payer) if step.payer else None
    if share is not None:
        share.served += cpu_seconds - step.charge
    step.payer, step.charge = None, 0.0
