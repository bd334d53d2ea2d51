"""Requests about jobs: find, cancel, delete, wait, focus and pin."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from fastapi.concurrency import contextmanager_in_threadpool, run_in_threadpool
from sqlalchemy import bindparam, func, select, text
from sqlalchemy.orm import Session

from schemas.api.jobs import Job, JobState, Region
from schemas.api.plans import PlanDocument
from schemas.reading import read_document
from service.access.principals import Principal
from service.errors import ForbiddenError, PictureGoneError, UnavailableError, UnknownJobError
from service.jobs.context import Service
from service.lifecycle import damage, rows, sharing
from service.lifecycle.documents import documents
from service.settings import Settings
from service.storage.database.models import JobRow, RenderRow, RequestRow

# How long a request waits for the workers of a job it must stop, beyond their grace period.
STOP_SECONDS = 5.0


_STATUS = (
    select(JobRow.state, RenderRow.last_seq)
    .outerjoin(RenderRow, JobRow.render_number == RenderRow.number)
    .where(JobRow.id == bindparam("id"))
)


class JobStatus(NamedTuple):
    """The columns of a job that waiting requests read again and again."""

    state: JobState
    last_seq: int


def find(session: Session, job_id: str) -> JobRow:
    """Find a job; UnknownJobError if there is none, DamagedJobError if it cannot be read."""
    with damage.reading(job_id):
        row = session.scalar(select(JobRow).where(JobRow.id == job_id)) if job_id.isalnum() else None
    if row is None:
        raise UnknownJobError
    return row


def owner_of(session: Session, job_id: str, asked_by: str | None) -> str:
    """Return the owner of a job; UnknownJobError if this user may not see it. None sees all jobs."""
    owner = session.scalar(select(JobRow.owner).where(JobRow.id == job_id))
    if owner is None or asked_by not in (None, owner):
        raise UnknownJobError
    return owner


def find_render(session: Session, job_id: str) -> RenderRow:
    """Find the render of a job.

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
        return shown(session, job_id, service.settings)


def shown(session: Session, job_id: str, settings: Settings) -> Job:
    """Describe a job within a transaction."""
    found = damage.load(session, select(JobRow).where(JobRow.id == job_id)) if job_id.isalnum() else ()
    if not found:
        raise UnknownJobError
    [job] = documents(session, found, settings.keep_seconds)
    return job


def plan_of(service: Service, job_id: str) -> PlanDocument:
    """Return the plan that was made when the job was submitted."""
    with service.database.reading() as session:
        return PlanDocument.model_validate(find(session, job_id).plan)


@contextmanager
def _changing(service: Service, job_id: str) -> Iterator[tuple[Session, JobRow]]:
    """Change a job in a transaction that notifies the watchers of other servers.

    Those of this one are notified by `publish`, after all that follows from the change.
    """
    with service.database.writing() as session:
        yield session, find(session, job_id)
        service.database.notify_jobs(session, (job_id,))


def cancel(service: Service, job_id: str) -> None:
    """End a job, and stop its render if no other job shares it. A job that has ended stays as it is."""
    with _changing(service, job_id) as (session, row):
        render = None if row.state.final else row.render
        stopping = None if row.state.final else _end(session, row)
        if stopping:
            service.database.notify(session, work=True)
    if stopping:
        service.dispatcher.cancel(stopping)
    if render is not None and render.state.final:
        service.spans.ended(render.id)
    service.job_events.publish((job_id,))


def _end(session: Session, row: JobRow) -> str | None:
    """End an open job; return the id of its render if that must be stopped first."""
    render = row.render
    assert render is not None
    if sharing.is_shared(session, row):
        sharing.leave_ended(session, row, JobState.CANCELLED)
    elif render.state is JobState.QUEUED:
        rows.end(session, render, JobState.CANCELLED)
    else:
        render.cancel_requested = True
        return render.id
    return None


def pause(service: Service, job_id: str) -> Job:
    """Pause a job: no more of its tiles are started. A job that has ended stays as it is."""
    with _changing(service, job_id) as (session, row):
        if not row.state.final:
            sharing.pause(session, row)
    service.job_events.publish((job_id,))
    return show(service, job_id)


def resume(service: Service, job_id: str) -> Job:
    """Resume a paused job; other jobs stay as they are."""
    with _changing(service, job_id) as (session, row):
        if not row.state.final:
            sharing.resume(session, row)
        service.database.notify(session, work=True)
    service.dispatcher.wake()
    service.job_events.publish((job_id,))
    return show(service, job_id)


async def stop(service: Service, job_id: str) -> Job:
    """Cancel a job and wait for a while until no part of it runs."""
    await service.write(cancel, service, job_id)
    timeout = service.settings.cancel_grace_seconds + STOP_SECONDS
    await until(service, job_id, timeout, lambda status: status.state.final)
    return await run_in_threadpool(show, service, job_id)


async def remove(service: Service, job_id: str) -> None:
    """Stop a job and forget it.

    Raises
    ------
    UnavailableError
        If it could not be stopped in time.
    """
    async with contextmanager_in_threadpool(service.reserve.given_up()):
        job = await stop(service, job_id)
        if not job.state.final:
            raise UnavailableError("The job is being stopped. Delete it again in a moment.")
        await service.write(_forget, service, job_id)


def _forget(service: Service, job_id: str) -> None:
    with _changing(service, job_id) as (session, row):
        unused = sharing.forget(session, row)
    if unused:
        service.store.drop_job(unused.id)
    service.job_events.publish((job_id,))


async def until(service: Service, job_id: str, seconds: float, done: Callable[[JobStatus], bool]) -> None:
    """Wait until a condition on a job holds, or the time is up, or the service stops."""
    deadline = time.monotonic() + seconds
    with service.job_events.watch(job_id) as watcher:
        while True:
            status = await run_in_threadpool(_status_of, service, job_id)
            left = deadline - time.monotonic()
            if done(status) or left <= 0 or not await watcher.wait(left):
                return


def _status_of(service: Service, job_id: str) -> JobStatus:
    with service.database.reading() as session:
        row = session.execute(_STATUS, {"id": job_id}).first()
    if row is None:
        raise UnknownJobError
    return JobStatus(row[0], row[1] or 0)


def focus(service: Service, job_id: str, body: bytes) -> None:
    """Render the tiles of a region before the others of their pass. A job that has ended stays as it is.

    Jobs that share a render share its order: the last request counts.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    PictureGoneError
        If the job has ended without a picture.
    renderer.SceneError
        If the region has no pixels.
    """
    with service.database.reading() as session:
        find_render(session, job_id)
    region, _ = read_document(body, Region, limits=service.settings.limits)
    with service.database.writing() as session:
        render = find_render(session, job_id)
        if not render.state.final:
            render.focus = region.model_dump()


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
        row = find(session, job_id)
        if row.state is JobState.EXPIRED:
            raise PictureGoneError("The picture has expired. Submit the job again for a new one.")
        if not row.pinned and not principal.sees_all:
            _check_pins(session, principal, service.settings.max_user_pins)
        row.pinned = True
        if row.render is not None:
            row.render.idle_since = None
    return show(service, job_id)


def unpin(service: Service, job_id: str) -> Job:
    """Let the picture of a job expire like any other."""
    with service.database.writing() as session:
        row = find(session, job_id)
        row.pinned = False
        if row.render is not None and row.render.state is JobState.SUCCEEDED:
            rows.note_idle(session, row.render)
    return show(service, job_id)


def _check_pins(session: Session, principal: Principal, most: int) -> None:
    mine = select(func.count()).select_from(JobRow).where(JobRow.owner == principal.name, text("pinned"))
    if session.scalars(mine).one() >= most:
        raise ForbiddenError(f"You have pinned {most} jobs, the maximum. Unpin or delete one first.")


def request_of(service: Service, job_id: str) -> bytes:
    """Return the request of a job, as compact JSON.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    """
    with service.database.reading() as session:
        return zlib.decompress(session.get_one(RequestRow, find(session, job_id).number).body)
