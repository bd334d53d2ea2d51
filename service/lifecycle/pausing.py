"""Jobs that stand still: no more tiles are handed out for them, and their time does not run on.

A render stands still while all who wait for it have paused. As in ``ledger.py`` every function works in a
transaction of its caller.
"""

from __future__ import annotations

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from service.lifecycle import clock as moments
from service.lifecycle import fairness, rows
from service.storage.database.models import JobRow, RenderRow


def pause(session: Session, row: JobRow) -> None:
    """Let an open job stand still; one that does so already goes on doing it."""
    if row.paused_at is None:
        row.paused_at = moments.now()
        follow(session, row.render)


def resume(session: Session, row: JobRow) -> None:
    """Let a job go on, if it stands still."""
    if row.paused_at is not None:
        _go_on(row)
        follow(session, row.render)
        fairness.activate(session, [row.owner])


def follow(session: Session, render: RenderRow | None) -> None:
    """Let a render stand still if all have paused who wait for it, and go on if one has not."""
    if render is None:
        return
    waiting = JobRow.render_number == render.number, JobRow.state.in_(rows.OPEN)
    if session.scalar(select(exists().where(*waiting, JobRow.paused_at.is_(None)))):
        _go_on(render)
    elif render.paused_at is None and session.scalar(select(exists().where(*waiting))):
        render.paused_at = moments.now()


def ran_for(row: JobRow | RenderRow) -> float:
    """Say for how many seconds a job or a render has run that has begun, without those it stood still.

    Of its columns ``started_at``, ``paused_at`` and ``paused_seconds`` are enough.
    """
    assert row.started_at is not None
    return moments.since(row.started_at) - _stood(row)


def _go_on(row: JobRow | RenderRow) -> None:
    row.paused_seconds, row.paused_at = _stood(row), None


def _stood(row: JobRow | RenderRow) -> float:
    """For how many seconds it has stood still since it began to run."""
    if row.paused_at is None or row.started_at is None:
        return row.paused_seconds
    return row.paused_seconds + min(moments.since(row.paused_at), moments.since(row.started_at))
