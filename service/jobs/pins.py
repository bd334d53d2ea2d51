"""Pinned jobs: their pictures are kept, however old they are and however many there are."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from schemas.jobs import Job, JobState
from service.access.principals import Principal
from service.errors import ForbiddenError, PictureGoneError
from service.jobs import lifecycle as jobs
from service.jobs.context import Service
from service.storage.database.models import JobRow


def pin(service: Service, job_id: str, principal: Principal) -> Job:
    """Keep the picture of a job.

    Raises
    ------
    PictureGoneError
        If it has expired already.
    ForbiddenError
        If the user, not being staff, has as many pinned jobs as allowed.
    """
    with service.database.writing() as session:
        row = jobs.find(session, job_id)
        if row.state is JobState.EXPIRED:
            raise PictureGoneError("The picture has expired. Submit the job again to have another.")
        if not row.pinned and not principal.sees_all:
            _check_number(session, principal, service.settings.max_user_pins)
        row.pinned = True
    return jobs.show(service, job_id)


def unpin(service: Service, job_id: str) -> Job:
    """Let a job go when its time has come, as any other."""
    with service.database.writing() as session:
        jobs.find(session, job_id).pinned = False
    return jobs.show(service, job_id)


def _check_number(session: Session, principal: Principal, most: int) -> None:
    mine = select(func.count()).select_from(JobRow).where(JobRow.owner == principal.name, JobRow.pinned)
    if session.scalars(mine).one() >= most:
        raise ForbiddenError(f"You have pinned {most} jobs, as many as you may. Unpin or delete one first.")
