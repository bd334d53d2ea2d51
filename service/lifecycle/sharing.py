"""Jobs that share a render: they pause, leave, expire and run out of time one by one.

A render pauses once all jobs that wait for it have paused, and is deleted with the last job that refers to
it. As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import case, exists, select, update
from sqlalchemy.orm import Session

from schemas.api.jobs import Failure, JobState
from service.lifecycle import clock, fairness, rows, totals
from service.lifecycle.documents import leave
from service.storage.database.models import AssetRow, AssetUseRow, JobRow, RenderRow

# Only the time columns: there may be a row for each waiting job.
_LIMITED = select(
    JobRow.number, JobRow.time_limit, JobRow.started_at, JobRow.paused_at, JobRow.paused_seconds
).where(JobRow.state == JobState.RUNNING, JobRow.time_limit.is_not(None), JobRow.paused_at.is_(None))


def is_shared(session: Session, row: JobRow) -> bool:
    """Whether another job waits for the render of an open one."""
    others = JobRow.render_number == row.render_number, JobRow.number != row.number
    return bool(session.scalar(select(exists().where(*others, JobRow.state.in_(rows.OPEN)))))


def pause(session: Session, row: JobRow) -> None:
    """Pause an open job; a paused one stays as it is."""
    if row.paused_at is None:
        row.paused_at = clock.now()
        follow(session, row.render)


def resume(session: Session, row: JobRow) -> None:
    """Resume a job if it is paused."""
    if row.paused_at is not None:
        _end_pause(row)
        follow(session, row.render)
        fairness.activate(session, [row.owner])


def follow(session: Session, render: RenderRow | None) -> None:
    """Pause a render if all jobs that wait for it have paused, and resume it if one has not."""
    if render is None:
        return
    waiting = JobRow.render_number == render.number, JobRow.state.in_(rows.OPEN)
    if session.scalar(select(exists().where(*waiting, JobRow.paused_at.is_(None)))):
        _end_pause(render)
    elif render.paused_at is None and session.scalar(select(exists().where(*waiting))):
        render.paused_at = clock.now()


def add_outage(session: Session, seconds: float) -> None:
    """Count the last seconds as a pause of everything that ran, since nothing could be rendered."""
    for table in (JobRow, RenderRow) if seconds else ():
        times = select(table.number, table.started_at, table.paused_at, table.paused_seconds)
        ran: Any = session.execute(times.where(table.state == JobState.RUNNING, table.paused_at.is_(None)))
        paused = [
            {"number": row.number, "paused_seconds": row.paused_seconds + min(seconds, rows.ran_for(row))}
            for row in ran
        ]
        if paused:
            session.execute(update(table), paused)


def _end_pause(row: JobRow | RenderRow) -> None:
    row.paused_seconds, row.paused_at = rows.paused_for(row), None


def leave_ended(session: Session, row: JobRow, state: JobState, failure: Failure | None = None) -> None:
    """End one open job; its render continues for the others."""
    render = row.render
    leave(row)
    rows.end_alone(session, row, state, failure)
    _pass_on_load(session, row, render)
    follow(session, render)


def _pass_on_load(session: Session, row: JobRow, render: RenderRow | None) -> None:
    """Pass the queue load of a job on to another that waits for its render, which continues.

    It is the next of the same owner, if there is one, or else the oldest.
    """
    if render is None or not row.load:
        return
    waiting = JobRow.render_number == render.number, JobRow.state.in_(rows.OPEN)
    order = case((JobRow.owner == row.owner, 0), else_=1), JobRow.number
    heir = session.scalar(select(JobRow).where(*waiting).order_by(*order).limit(1))
    if heir is not None:
        heir.load, row.load = heir.load + row.load, 0.0


def end_late(session: Session) -> tuple[list[RenderRow], list[str], float | None]:
    """Fail the jobs whose time limit is spent.

    Returns
    -------
    tuple
        The renders that ended with them, the ids of the jobs that left a shared render, and the seconds until
        the next time limit.
    """
    ended, left, upcoming = [], [], []
    limited: Any
    for limited in session.execute(_LIMITED).all():
        remaining = limited.time_limit - rows.ran_for(limited)
        if remaining > 0:
            upcoming.append(remaining)
            continue
        job = session.get_one(JobRow, limited.number)
        if is_shared(session, job):
            leave_ended(session, job, JobState.FAILED, _late(limited.time_limit))
            left.append(job.id)
        elif job.render is not None and not job.render.cancel_requested:
            rows.end(session, job.render, JobState.FAILED, _late(limited.time_limit))
            ended.append(job.render)
    return ended, left, min(upcoming, default=None)


def _late(seconds: float) -> Failure:
    message = (
        f"The picture was not finished within {seconds:g} seconds. Give it more time, ask for fewer samples, "
        "or for target quality, which ends with the best picture so far."
    )
    return Failure(code="time_limit", message=message, retryable=False)


class Unused(NamedTuple):
    """A render to which no job refers any more, and the bytes that it has in the store."""

    id: str
    bytes: int


def expire(session: Session, row: JobRow) -> Unused | None:
    """Take a picture from its job; return the render if no job refers to it any more."""
    render, ended = row.render, row.finished_at
    leave(row)
    row.state = JobState.EXPIRED
    return _without(session, render, row, ended)


def forget(session: Session, row: JobRow) -> Unused | None:
    """Delete a job; return its render if no job refers to it any more."""
    render = row.render
    if row.failure is not None:
        totals.add_failed(session, row.failure["code"], -1)
    session.delete(row)
    return _without(session, render, row, row.finished_at)


def _without(
    session: Session, render: RenderRow | None, row: JobRow, ended: datetime | None
) -> Unused | None:
    """Delete a render, unless a job is left that refers to it."""
    session.flush()
    if render is None:
        return None
    if not session.scalar(select(exists().where(JobRow.render_number == render.number))):
        return _delete(session, render)
    # Jobs expire in the order in which they end, so nearly always the newest one is left.
    if render.state is JobState.SUCCEEDED and (row.pinned or ended == render.idle_since):
        rows.note_idle(session, render)
    return None


def _delete(session: Session, render: RenderRow) -> Unused:
    stored = render.stored_bytes or 0
    if render.state is JobState.SUCCEEDED:
        totals.add(session, totals.STORED_BYTES, -stored)
    used = select(AssetUseRow.sha256).where(AssetUseRow.render == render.number)
    session.execute(update(AssetRow).where(AssetRow.sha256.in_(used)).values(renders=AssetRow.renders - 1))
    session.delete(render)
    session.flush()
    return Unused(render.id, stored)
