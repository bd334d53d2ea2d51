"""Fairness: users share the workers by the CPU seconds rendered for them.

Start-time fair queueing. Each user has a clock, `served`: the CPU seconds charged to the user. The next tile
is of the active user whose clock is behind all others. A tile is charged when it is handed out, at the price
that is expected, and put right when it is finished. A user who comes back after a pause starts from the
present (`turn`, the clock of the user served last): a pause is no credit. So a new user waits for no more
than the tiles that are handed out already, however much another has waiting.

A user's jobs start by priority and age, each with its coarse picture before any of them continues. So a
queued job starts when its user's clock has come as far as the coarse pictures of the jobs before it take it,
and the jobs of all users start in the order of these clocks (`positions`). Jobs that share a render start
with the first of them.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.storage.database.models import JobRow, RenderRow, ShareRow, TileRow

_NEXT = (
    select(ShareRow)
    .where(ShareRow.active, ShareRow.owner.not_in(bindparam("resting", expanding=True)))
    .order_by(ShareRow.served, ShareRow.owner)
    .limit(2)
)
_NOW = select(func.max(ShareRow.turn))


def activate(session: Session, owners: Iterable[str]) -> None:
    """Activate users who have waiting steps."""
    for owner in owners:
        share = session.get(ShareRow, owner)
        if share is None:
            now = session.scalar(_NOW) or 0.0
            session.add(ShareRow(owner=owner, served=now, turn=now, active=True))
        elif not share.active:
            share.active = True
            share.served = max(share.served, session.scalar(_NOW) or 0.0)


def activate_all_of(session: Session, render: RenderRow) -> None:
    """Activate the users whose jobs share a render with waiting steps."""
    sharing = JobRow.render_number == render.number, JobRow.finished_at.is_(None)
    activate(session, session.scalars(select(JobRow.owner).where(*sharing).distinct()).all())


def next_share(session: Session, resting: Collection[str]) -> tuple[ShareRow | None, float]:
    """Return the user whose turn it is, without ``resting`` ones, and the clock up to which it lasts."""
    first, second = [*session.scalars(_NEXT, {"resting": list(resting)}).all(), None, None][:2]
    return first, second.served if second else float("inf")


def charge(share: ShareRow, step: TileRow, cpu_seconds: float) -> None:
    """Charge a user with what a step is expected to cost."""
    share.turn = share.served
    share.served += cpu_seconds
    step.payer, step.charge = share.owner, cpu_seconds


def settle(session: Session, step: TileRow, cpu_seconds: float) -> None:
    """Correct the charge of a step: to its actual cost, or to nothing if it is repeated."""
    share = session.get(ShareRow, step.payer) if step.payer else None
    if share is not None:
        share.served += cpu_seconds - step.charge
    step.payer, step.charge = None, 0.0


_STRIDE = RenderRow.passes[0]["stride"].as_integer()
_COARSE_WORK = ((RenderRow.width + _STRIDE - 1) // _STRIDE) * ((RenderRow.height + _STRIDE - 1) // _STRIDE)
_COARSE_CPU_SECONDS = RenderRow.predicted_cpu_seconds * _COARSE_WORK / RenderRow.total_work
"""The charge for a coarse picture, as `rows.expected_cpu_seconds` predicts it for its step."""

_OWN_ORDER = (JobRow.priority.desc(), JobRow.number)
_BEFORE = func.sum(_COARSE_CPU_SECONDS).over(partition_by=JobRow.owner, order_by=_OWN_ORDER, rows=(None, -1))
_CLOCKS = (
    select(
        JobRow.number,
        JobRow.owner,
        JobRow.priority,
        JobRow.render_number.label("render"),
        (func.coalesce(ShareRow.served, 0.0) + func.coalesce(_BEFORE, 0.0)).label("clock"),
    )
    .join(RenderRow, JobRow.render_number == RenderRow.number)
    .join(ShareRow, ShareRow.owner == JobRow.owner, isouter=True)
    .where(JobRow.state == JobState.QUEUED, JobRow.paused_at.is_(None))
    .subquery()
)
_ORDER = (_CLOCKS.c.clock, _CLOCKS.c.owner, _CLOCKS.c.priority.desc(), _CLOCKS.c.number)
_PLACES = select(
    _CLOCKS.c.number, _CLOCKS.c.render, func.row_number().over(order_by=_ORDER).label("place")
).subquery()
_STARTS = select(
    _PLACES.c.number, func.min(_PLACES.c.place).over(partition_by=_PLACES.c.render).label("start")
).subquery()
_RANKS = select(_STARTS.c.number, func.rank().over(order_by=_STARTS.c.start).label("rank")).subquery()
_POSITIONS = select(_RANKS).where(_RANKS.c.number.in_(bindparam("numbers", expanding=True)))


def positions(session: Session, jobs: Iterable[JobRow]) -> dict[int, int]:
    """Count the queued jobs that start before each of these, in one query.

    Returns
    -------
    dict
        By the number of the job; those that are not queued, or paused, are left out.
    """
    numbers = [job.number for job in jobs if job.state is JobState.QUEUED and job.paused_at is None]
    if not numbers:
        return {}
    return {number: rank - 1 for number, rank in session.execute(_POSITIONS, {"numbers": numbers})}
