"""What requests do with jobs: find, list, cancel, remove, and wait for them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from fastapi.concurrency import run_in_threadpool
from sqlalchemy import bindparam, exists, func, select
from sqlalchemy.orm import Session

from schemas.jobs import Job, JobList, JobState
from schemas.plans import PlanDocument
from service import rows
from service.context import Service
from service.database.models import JobRow, RenderRow
from service.errors import PictureGoneError, UnavailableError, UnknownJobError
from service.job_documents import document, leave

# How long a request that must stop a job first waits for its workers, beyond the grace they have.
STOP_SECONDS = 5.0


_STANDING = (
    select(JobRow.state, RenderRow.last_seq)
    .outerjoin(RenderRow, JobRow.render_number == RenderRow.number)
    .where(JobRow.id == bindparam("id"))
)


class Standing(NamedTuple):
    """As much of a job as those who wait for it look at, again and again."""

    state: JobState
    last_seq: int


def find(session: Session, job_id: str) -> JobRow:
    """Find a job; UnknownJobError if there is none."""
    row = session.scalar(select(JobRow).where(JobRow.id == job_id)) if job_id.isalnum() else None
    if row is None:
        raise UnknownJobError
    return row


def find_render(session: Session, job_id: str) -> RenderRow:
    """Find what is rendered for a job.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    PictureGoneError
        If the job has left it.
    """
    row = find(session, job_id)
    if row.render is None:
        raise PictureGoneError(f"There is no picture. The job ended as {row.state.value}.")
    return row.render


def show(service: Service, job_id: str) -> Job:
    """Describe a job as it is now."""
    with service.database.reading() as session:
        return document(session, find(session, job_id))


def page(service: Service, limit: int, cursor: int | None) -> JobList:
    """Describe the newest jobs, or those older than the last one of the page before."""
    query = select(JobRow).order_by(JobRow.number.desc()).limit(limit + 1)
    if cursor is not None:
        query = query.where(JobRow.number < cursor)
    with service.database.reading() as session:
        found = session.scalars(query).all()
        following = str(found[limit - 1].number) if len(found) > limit else None
        return JobList(jobs=tuple(document(session, row) for row in found[:limit]), next=following)


def plan_of(service: Service, job_id: str) -> PlanDocument:
    """Return the plan that was made when the job was submitted."""
    with service.database.reading() as session:
        return PlanDocument.model_validate(find(session, job_id).plan)


def cancel(service: Service, job_id: str) -> None:
    """End a job now, and have what runs for nobody else stopped; a job that has ended stays as it is."""
    with service.database.writing() as session:
        row = find(session, job_id)
        stopping = None if row.state.final else _end(session, row)
    if stopping:
        service.dispatcher.cancel(stopping)
    service.feed.publish((job_id,))


def _end(session: Session, row: JobRow) -> str | None:
    """End an open job; return the id of its render if that must be stopped first."""
    render = row.render
    assert render is not None
    if _shared(session, row):
        leave(row)
        rows.end_alone(row, JobState.CANCELLED)
    elif render.state is JobState.QUEUED:
        rows.end(session, render, JobState.CANCELLED)
    else:
        render.cancel_requested = True
        return render.id
    return None


def _shared(session: Session, row: JobRow) -> bool:
    """Whether another job waits for the same render."""
    others = JobRow.render_number == row.render_number, JobRow.number != row.number
    waiting = JobRow.state.in_(rows.OPEN)
    return bool(session.scalar(select(exists().where(*others, waiting))))


async def stop(service: Service, job_id: str) -> Job:
    """Cancel a job and wait until nothing of it runs any more, within reason."""
    await run_in_threadpool(cancel, service, job_id)
    patience = service.settings.cancel_grace_seconds + STOP_SECONDS
    await until(service, job_id, patience, lambda standing: standing.state.final)
    return await run_in_threadpool(show, service, job_id)


async def remove(service: Service, job_id: str) -> None:
    """Stop a job and forget it.

    Raises
    ------
    UnavailableError
        If it could not be stopped in time.
    """
    job = await stop(service, job_id)
    if not job.state.final:
        raise UnavailableError("The job is being stopped. Delete it again in a moment.")
    await run_in_threadpool(_forget, service, job_id)


def _forget(service: Service, job_id: str) -> None:
    with service.database.writing() as session:
        row = find(session, job_id)
        render = row.render
        session.delete(row)
        session.flush()
        unused = render if render and not _wanted(session, render) else None
        if unused:
            session.delete(unused)
    if unused:
        service.store.drop_job(unused.id)
    service.feed.publish((job_id,))


def _wanted(session: Session, render: RenderRow) -> bool:
    """Whether any job refers to a render."""
    query = select(func.count()).select_from(JobRow).where(JobRow.render_number == render.number)
    return bool(session.scalar(query))


async def until(service: Service, job_id: str, seconds: float, done: Callable[[Standing], bool]) -> None:
    """Wait until a job is as wanted, or the time is up, or the service stops."""
    deadline = time.monotonic() + seconds
    with service.feed.watch(job_id) as watcher:
        while True:
            standing = await run_in_threadpool(_standing, service, job_id)
            left = deadline - time.monotonic()
            if done(standing) or left <= 0 or not await watcher.wait(left):
                return


def _standing(service: Service, job_id: str) -> Standing:
    with service.database.reading() as session:
        row = session.execute(_STANDING, {"id": job_id}).first()
    if row is None:
        raise UnknownJobError
    return Standing(row[0], row[1] or 0)
