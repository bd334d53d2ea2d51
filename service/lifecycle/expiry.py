"""What ends by the clock: jobs whose time is spent.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from schemas.jobs import Failure, JobState
from service.lifecycle import pausing, rows, sharing
from service.storage.database.models import JobRow, RenderRow

# Only the columns of time: with a limit for each, there are as many of them as there are jobs that wait.
_LIMITED = select(
    JobRow.number, JobRow.time_limit, JobRow.started_at, JobRow.paused_at, JobRow.paused_seconds
).where(JobRow.state == JobState.RUNNING, JobRow.time_limit.is_not(None), JobRow.paused_at.is_(None))


def end_late(session: Session) -> tuple[list[RenderRow], list[str], float | None]:
    """Fail the jobs whose time is spent.

    Returns
    -------
    tuple
        The renders that ended with them, the ids of the jobs that left a render to others, and in how
        many seconds the time of the next one will be spent.
    """
    ended, left, upcoming = [], [], []
    limited: Any
    for limited in session.execute(_LIMITED).all():
        remaining = limited.time_limit - pausing.ran_for(limited)
        if remaining > 0:
            upcoming.append(remaining)
            continue
        job = session.get_one(JobRow, limited.number)
        if sharing.shared(session, job):
            sharing.leave_ended(session, job, JobState.FAILED, _late(limited.time_limit))
            left.append(job.id)
        elif job.render is not None and not job.render.cancel_requested:
            rows.end(session, job.render, JobState.FAILED, _late(limited.time_limit))
            ended.append(job.render)
    return ended, left, min(upcoming, default=None)


def _late(seconds: float) -> Failure:
    message = (
        f"The picture was not finished within {seconds:g} seconds. Give it more time, ask for fewer samples, "
        "or for target quality, which ends with the picture that there is."
    )
    return Failure(code="time_limit", message=message, retryable=False)
