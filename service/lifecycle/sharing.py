"""Jobs and the renders that they share: a job may leave; a render goes with the last that refers to it."""

from __future__ import annotations

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from schemas.jobs import Failure, JobState
from service.lifecycle import pausing, rows
from service.lifecycle.documents import leave
from service.storage.database.models import JobRow, RenderRow


def shared(session: Session, row: JobRow) -> bool:
    """Whether another job waits for the render of an open one."""
    others = JobRow.render_number == row.render_number, JobRow.number != row.number
    return bool(session.scalar(select(exists().where(*others, JobRow.state.in_(rows.OPEN)))))


def leave_ended(session: Session, row: JobRow, state: JobState, failure: Failure | None = None) -> None:
    """End an open job alone, and let its render go on for the others."""
    render = row.render
    leave(row)
    rows.end_alone(row, state, failure)
    pausing.follow(session, render)


def expire(session: Session, row: JobRow) -> str | None:
    """Take a picture from its job; return the id of the render if nothing refers to it any more."""
    render = row.render
    leave(row)
    row.state = JobState.EXPIRED
    session.flush()
    return _unused(session, render)


def forget(session: Session, row: JobRow) -> str | None:
    """Delete a job; return the id of its render if nothing refers to that any more."""
    render = row.render
    session.delete(row)
    session.flush()
    return _unused(session, render)


def _unused(session: Session, render: RenderRow | None) -> str | None:
    """Delete a render to which no job refers, and return its id."""
    if render is None or session.scalar(select(exists().where(JobRow.render_number == render.number))):
        return None
    session.delete(render)
    return render.id
