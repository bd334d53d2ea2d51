"""What ends by the clock: jobs whose time is spent, pictures that were kept long enough.

As in ``ledger.py`` every function works in a transaction of its caller.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from schemas.jobs import Failure, JobState
from service import pausing, rows, sharing
from service.database.models import IdempotencyRow, JobRow, RenderRow

KEY_LIFE = timedelta(hours=24)
"""How long an ``Idempotency-Key`` is remembered."""
# Jobs removed in one transaction, so that others need not wait long.
MANY = 100

_LIMITED = select(JobRow).where(
    JobRow.state == JobState.RUNNING, JobRow.time_limit.is_not(None), JobRow.paused_at.is_(None)
)
_FINISHED = select(JobRow).order_by(JobRow.finished_at).limit(MANY)


def end_late(session: Session) -> tuple[list[RenderRow], list[str], datetime | None]:
    """Fail the jobs whose time is spent.

    Returns
    -------
    tuple
        The renders that ended with them, the ids of the jobs that left a render to others, and when the time
        of the next one will be spent.
    """
    ended, left, upcoming = [], [], []
    for job in session.scalars(_LIMITED).all():
        assert job.time_limit is not None
        end = pausing.end_of(job, job.time_limit)
        if end > datetime.now(UTC):
            upcoming.append(end)
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


def sweep(session: Session, keep_seconds: float) -> Iterator[str]:
    """Take pictures kept long enough, forget jobs and keys; give the ids of renders that are unused."""
    now, kept = datetime.now(UTC), timedelta(seconds=keep_seconds)
    session.execute(delete(IdempotencyRow).where(IdempotencyRow.created_at < now - KEY_LIFE))
    old = _FINISHED.where(JobRow.state == JobState.SUCCEEDED, JobRow.finished_at < now - kept)
    gone = _FINISHED.where(JobRow.finished_at < now - 2 * kept)
    unused = [sharing.expire(session, job) for job in session.scalars(old).all()]
    unused += [sharing.forget(session, job) for job in session.scalars(gone).all()]
    yield from filter(None, unused)
