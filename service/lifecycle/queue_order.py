"""In which order queued jobs will start: that in which `service.dispatch.ledger` hands out their first tiles.

A user's jobs start by priority and age, each with its coarse picture before any of them goes on. Users take
turns (`fairness`): the next tile is of the one whose clock is behind. So a job starts when its user's clock
has come as far as the coarse pictures of the jobs before it take it, and the jobs of all users start in the
order of these clocks. Jobs that share a render start with the first of them.
"""

from __future__ import annotations

from collections.abc import Iterable

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from schemas.jobs import JobState
from service.storage.database.models import JobRow, RenderRow, ShareRow

_STRIDE = RenderRow.passes[0]["stride"].as_integer()
_COARSE_WORK = ((RenderRow.width + _STRIDE - 1) // _STRIDE) * ((RenderRow.height + _STRIDE - 1) // _STRIDE)
_COARSE_CPU_SECONDS = RenderRow.predicted_cpu_seconds * _COARSE_WORK / RenderRow.total_work
"""What a turn is charged for a coarse picture, as `rows.expected_cpu_seconds` says of its step."""

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
