"""What ends by the clock: jobs whose time is spent.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from schemas.jobs import Failure, JobState
from service import pausing, rows, sharing
from service.database.models import JobRow, RenderRow

_LIMITED = select(JobRow).where(
    JobRow.state == JobState.RUNNING, JobRow.time_limit.is_not(None), JobRow.paused_at.is_(None)
)


def end_late(session: Session) -> tuple[list[RenderRow], list[str], float | None]:
    """Fail the jobs whose time is spent.

    Returns
    -------
    tuple
        The renders that ended with them, the ids of the jobs that left a render to others, and in how
        many seconds the time of the next one will be spent.
    """
    ended, left, upcoming = [], [], []
    for job in session.scalars(_LIMITED).all():
        assert job.time_limit is not None
        remaining = job.time_limit - pausing.ran_for(job)
        if remaining > 0:
            upcoming.append(remaining)
        elif sharing.shared(session, job):
            sharing.leave_ended(session, job, JobState.FAILED, _late(job.time_limit))
            left.append(job.id)
        elif job.render is not None and not job.render.cancel_requested:
            rows.end(session, job.render, JobState.FAILED, _late(job.time_limit))
            ended.append(job.render)
    return ended, left, min(upcoming, default=None)


def _late(seconds: float) -> Failure:
    message = (
        f"The picture was not finished within {seconds:g} seconds. Give it more time, ask for fewer samples, "
        "or for target quality, which ends with the picture that there is."
    )
    return Failure(code="time_limit", message=message, retryable=False)
