"""Pausing jobs: no more tiles are handed out for them, and their time does not run on.

A render is paused while all who wait for it have paused. As in ``ledger.py`` every function works in a
transaction of its caller.
"""

from __future__ import annotations

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from service.lifecycle import clock, fairness, rows
from service.storage.database.models import JobRow, RenderRow


def pause(session: Session, row: JobRow) -> None:
    """Pause an open job; one that is paused already stays so."""
    if row.paused_at is None:
        row.paused_at = clock.now()
        follow(session, row.render)


def resume(session: Session, row: JobRow) -> None:
    """Resume a job, if it is paused."""
    if row.paused_at is not None:
        _go_on(row)
        follow(session, row.render)
        fairness.activate(session, [row.owner])


def follow(session: Session, render: RenderRow | None) -> None:
    """Pause a render if all have paused who wait for it, and resume it if one has not."""
    if render is None:
        return
    waiting = JobRow.render_number == render.number, JobRow.state.in_(rows.OPEN)
    if session.scalar(select(exists().where(*waiting, JobRow.paused_at.is_(None)))):
        _go_on(render)
    elif render.paused_at is None and session.scalar(select(exists().where(*waiting))):
        render.paused_at = clock.now()


def ran_for(row: JobRow | RenderRow) -> float:
    """Say for how many seconds a job or a render has run that has begun, without those it was paused.

    Of its columns ``started_at``, ``paused_at`` and ``paused_seconds`` are enough.
    """
    assert row.started_at is not None
    return clock.since(row.started_at) - _stood(row)


def _go_on(row: JobRow | RenderRow) -> None:
    row.paused_seconds, row.paused_at = _stood(row), None


def _stood(row: JobRow | RenderRow) -> float:
    """For how many seconds it has been paused since it began to run."""
    if row.paused_at is None or row.started_at is None:
        return row.paused_seconds
    return row.paused_seconds + min(clock.since(row.paused_at), clock.since(row.started_at))
