"""Jobs that share a render: they pause, leave, expire and run out of time one by one.

A render pauses once all jobs that wait for it have paused, and is deleted with the last job that refers to
it. As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from schemas.api.jobs import Failure, JobState
from service.lifecycle import clock, fairness, rows
from service.lifecycle.documents import leave
from service.storage.database.models import JobRow, RenderRow

# Only the columns of time: with a limit for each, there are as many of them as there are jobs that wait.
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


def _end_pause(row: JobRow | RenderRow) -> None:
    row.paused_seconds, row.paused_at = rows.paused_for(row), None


def leave_ended(session: Session, row: JobRow, state: JobState, failure: Failure | None = None) -> None:
    """End an open job alone; its render continues for the others."""
    render = row.render
    leave(row)
    rows.end_alone(row, state, failure)
    follow(session, render)


def end_late(session: Session) -> tuple[list[RenderRow], list[str], float | None]:
    """Fail the jobs whose time limit is spent.

    Returns
    -------
    tuple
        The renders that ended with them, the ids of the jobs that left a render to others, and in how
        many seconds the next time limit will be spent.
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


def expire(session: Session, row: JobRow) -> str | None:
    """Take a picture from its job; return the id of the render if no job refers to it any more."""
    render = row.render
    leave(row)
    row.state = JobState.EXPIRED
    return _delete_unused(session, render)


def forget(session: Session, row: JobRow) -> str | None:
    """Delete a job; return the id of its render if no job refers to it any more."""
    render = row.render
    session.delete(row)
    return _delete_unused(session, render)


def _delete_unused(session: Session, render: RenderRow | None) -> str | None:
    session.flush()
    if render is None or session.scalar(select(exists().where(JobRow.render_number == render.number))):
        return None
    session.delete(render)
    return render.id
