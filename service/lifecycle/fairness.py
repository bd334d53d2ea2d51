"""Fairness: users share the workers by the CPU seconds rendered for them.

Start-time fair queueing. Each user has a clock, `served`: the CPU seconds charged to the user. The next tile
is of the active user whose clock is behind all others. A tile is charged when it is handed out, at its
expected price, and corrected to its actual cost at its end or at the end of its time slice; a call is charged
at its cost. A user who returns after a pause starts at the present (`turn`, the clock of the user served
last), since a pause earns no credit. So a new user waits only for the tiles in progress, each for one time
slice at most, however many tiles of others wait.

A user's jobs start by priority and age, each with its coarse picture before any of them continues. So a
queued job starts when its user's clock has advanced by the coarse pictures of the jobs before it, and the
jobs of all users start in the order of these clocks (`positions`). Jobs that share a render start with the
first of them.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

import numpy as np
from sqlalchemy import Row, bindparam, case, func, select, text
from sqlalchemy.orm import Session, aliased

from schemas.api.jobs import JobState
from service.storage.database.conditions import WAITS_TO_START
from service.storage.database.models import Base, JobRow, RenderRow, ShareRow, TileRow
from service.workers.heartbeats import SLICE_SECONDS

_NEXT = (
    select(ShareRow)
    .where(ShareRow.active, ShareRow.owner.not_in(bindparam("resting", expanding=True)))
    .order_by(ShareRow.served, ShareRow.owner)
    .limit(2)
)
_CLOCK = aliased(ShareRow)
# A part of the statement that uses it, since reading it first would take longer.
_NOW = select(func.coalesce(func.max(_CLOCK.turn), 0.0)).scalar_subquery()
_WANTING = select(JobRow.owner).where(JobRow.finished_at.is_(None), JobRow.paused_at.is_(None)).limit(1)
# The ends of the index of open jobs: one user may have thousands of them.
_ENDS = select(
    *(_WANTING.order_by(end).scalar_subquery() for end in (JobRow.owner.asc(), JobRow.owner.desc()))
)


def activate(session: Session, owners: Iterable[str]) -> None:
    """Activate users who have waiting steps."""
    for owner in owners:
        _present(session, owner).active = True


def charge_calls(session: Session, seconds: Mapping[str, float]) -> None:
    """Charge users for the calls that workers have answered."""
    # In one order: of two servers that charge the same users, one waits.
    for owner in sorted(seconds):
        share = _present(session, owner)
        share.served += seconds[owner]
        share.charged += seconds[owner]


def _present(session: Session, owner: str) -> ShareRow:
    """Return the share of a user, with the clock advanced to the present after a pause."""
    share = session.get(ShareRow, owner)
    if share is None:
        share = ShareRow(owner=owner, served=_NOW, turn=_NOW, active=False, charged=0.0)
        session.add(share)
    elif not share.active:
        share.served = case((ShareRow.served > _NOW, ShareRow.served), else_=_NOW)
    return share


def activate_all_of(session: Session, render: RenderRow) -> None:
    """Activate the users whose jobs share a render with waiting steps."""
    sharing = JobRow.render_number == render.number, JobRow.finished_at.is_(None)
    activate(session, session.scalars(select(JobRow.owner).where(*sharing).distinct()).all())


def is_contended(session: Session) -> bool:
    """Whether jobs of more than one user are open."""
    first, last = session.execute(_ENDS).one()
    return bool(first != last)


def next_share(session: Session, resting: Collection[str]) -> tuple[ShareRow | None, float]:
    """Return the user whose turn it is, without ``resting`` ones, and the clock up to which it lasts."""
    first, second = [*session.scalars(_NEXT, {"resting": list(resting)}).all(), None, None][:2]
    return first, second.served if second else float("inf")


def charge(share: ShareRow, step: TileRow, cpu_seconds: float) -> None:
    """Charge a user for the expected cost of a step, up to the end of its time slice."""
    share.turn = share.served
    step.payer, step.charge = share.owner, min(cpu_seconds, SLICE_SECONDS)
    share.served += step.charge
    share.charged += step.charge


def settle(session: Session, step: TileRow, cpu_seconds: float) -> None:
    """Correct the charge of a step: to its actual cost, or to nothing if it is repeated."""
    share = session.get(ShareRow, step.payer) if step.payer else None
    if share is not None:
        share.served += cpu_seconds - step.charge
        share.charged += cpu_seconds - step.charge
    step.payer, step.charge = None, 0.0


def coarse_cpu_seconds(render: RenderRow) -> float:
    """Predict the charge for a coarse picture when it is handed out."""
    stride = render.passes[0]["stride"]
    work = -(-render.width // stride) * -(-render.height // stride)
    return min(render.predicted_cpu_seconds * work / render.total_work, SLICE_SECONDS)


# All columns are in the index of the queue, which has them in this order: no row is read, and none sorted.
_JOBS = Base.metadata.tables["jobs"].c
QUEUE = (
    select(_JOBS.owner, _JOBS.render_number, _JOBS.coarse_cpu_seconds)
    .where(text(WAITS_TO_START), _JOBS.render_number.is_not(None))
    .order_by(_JOBS.owner, _JOBS.priority.desc(), _JOBS.number)
)
_SERVED = select(ShareRow.owner, ShareRow.served).where(
    ShareRow.owner.in_(select(_JOBS.owner).where(text(WAITS_TO_START)))
)


def positions(session: Session, jobs: Iterable[JobRow]) -> dict[int, int]:
    """Count the queued jobs that start before each of these, in two queries.

    Returns
    -------
    dict
        By the number of the job; those that are not queued, or paused, are left out.
    """
    waiting = [job for job in jobs if job.state is JobState.QUEUED and job.paused_at is None]
    if not waiting:
        return {}
    before = _starts(session)
    return {job.number: before[job.render_number] for job in waiting if job.render_number in before}


def _starts(session: Session) -> dict[int | None, int]:
    """Count the queued jobs that start before those of each render."""
    # Without ORM objects: there may be ten thousand rows for a page of a hundred jobs.
    queue = session.connection().execute(QUEUE).all()
    served = dict(session.execute(_SERVED).all())
    if not queue:
        return {}
    # Equal clocks keep the order of the query: by owner, then by the owner's order of jobs.
    order = np.argsort([*_clocks(queue, served)], kind="stable")
    renders = np.array([render for _, render, _ in queue])[order]
    known, first, sharing = np.unique(renders, return_index=True, return_counts=True)
    by_start = np.argsort(first)
    before = np.cumsum(sharing[by_start]) - sharing[by_start]
    return dict(zip(known[by_start].tolist(), before.tolist(), strict=True))


def _clocks(queue: Iterable[Row[str, int, float]], served: Mapping[str, float]) -> Iterator[float]:
    """Predict the clock of each job's owner when it starts."""
    current, clock = None, 0.0
    for owner, _, cpu_seconds in queue:
        if owner != current:
            current, clock = owner, served.get(owner, 0.0)
        yield clock
        clock += cpu_seconds
