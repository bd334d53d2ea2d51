"""What requests do with jobs: create, find, list, cancel, remove, and wait for them."""

from __future__ import annotations

import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any, NamedTuple

import structlog
from fastapi.concurrency import run_in_threadpool
from sqlalchemy import func, insert, select
from sqlalchemy.orm import Session

from renderer import progressive, tiling
from schemas.jobs import (
    Failure,
    Job,
    JobCost,
    JobLinks,
    JobList,
    JobState,
    Numerics,
    Progress,
    ReachedError,
    Work,
)
from schemas.plans import PlanDocument
from schemas.problems import Problem
from service import pass_costs, rows, targets
from service.admission import Admitted
from service.context import Service
from service.database.models import JobRow, TileRow
from service.errors import UnavailableError, UnknownJobError

# How long a request that must stop a job first waits for its workers, beyond the grace they have.
STOP_SECONDS = 5.0

log = structlog.get_logger()


class Standing(NamedTuple):
    """As much of a job as those who wait for it look at, again and again."""

    state: JobState
    last_seq: int


def create(service: Service, admitted: Admitted, body: bytes) -> str:
    """Keep a job with all its steps, and return its id."""
    plan = admitted.plan
    job_id = secrets.token_hex(8)
    steps, course = _course(admitted, service.settings.tile_size)
    row = JobRow(
        id=job_id,
        name=admitted.request.scene.name,
        width=plan.width,
        height=plan.height,
        spec_sha256=hashlib.sha256(body).hexdigest(),
        passes=[asdict(pass_) for pass_ in dict.fromkeys(pass_ for pass_, _ in steps)],
        display=admitted.request.scene.display.model_dump(),
        layers=list(admitted.request.layers),
        plan=admitted.description.model_dump(mode="json"),
        warnings=[warning.model_dump() for warning in admitted.warnings],
        total_steps=len(steps),
        predicted_cpu_seconds=admitted.description.cost.cpu_seconds,
        numerics=plan.numerics,
        created_at=datetime.now(UTC),
        **course,
    )
    service.store.put_spec(job_id, body)
    try:
        with service.database.writing() as session:
            session.add(row)
            session.flush()
            session.execute(
                insert(TileRow), [rows.new_step(row.number, pass_, tile) for pass_, tile in steps]
            )
    except BaseException:
        service.store.drop_job(job_id)
        raise
    service.dispatcher.wake()
    log.info("job queued", job=job_id, width=plan.width, height=plan.height, steps=len(steps))
    return job_id


def _course(admitted: Admitted, tile_size: int | None) -> tuple[list[targets.Step], dict[str, Any]]:
    """The steps of a job, as far as they are known, and the columns that tell how it goes on."""
    plan, target = admitted.plan, admitted.target
    if target is not None:
        return targets.begin(plan, target, tile_size, admitted.description.cost.camera_rays)
    steps = [(pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, tile_size)]
    return steps, {
        "total_work": sum(rows.work(pass_, tile) for pass_, tile in steps),
        "pass_costs": pass_costs.begin([pass_.index for pass_, _ in steps]),
        "error_unknown": progressive.unknown_error(plan),
    }


def find(session: Session, job_id: str) -> JobRow:
    """Find a job; UnknownJobError if there is none."""
    row = session.scalar(select(JobRow).where(JobRow.id == job_id)) if job_id.isalnum() else None
    if row is None:
        raise UnknownJobError
    return row


def show(service: Service, job_id: str) -> Job:
    """Describe a job as it is now."""
    with service.database.reading() as session:
        return _document(session, find(session, job_id))


def page(service: Service, limit: int, cursor: int | None) -> JobList:
    """Describe the newest jobs, or those older than the last one of the page before."""
    query = select(JobRow).order_by(JobRow.number.desc()).limit(limit + 1)
    if cursor is not None:
        query = query.where(JobRow.number < cursor)
    with service.database.reading() as session:
        found = session.scalars(query).all()
        following = str(found[limit - 1].number) if len(found) > limit else None
        return JobList(jobs=tuple(_document(session, row) for row in found[:limit]), next=following)


def plan_of(service: Service, job_id: str) -> PlanDocument:
    """Return the plan that was made when the job was submitted."""
    with service.database.reading() as session:
        return PlanDocument.model_validate(find(session, job_id).plan)


def cancel(service: Service, job_id: str) -> None:
    """End a queued job now and have a running one stopped; a job that has ended stays as it is."""
    with service.database.writing() as session:
        row = find(session, job_id)
        running = row.state is JobState.RUNNING
        if row.state is JobState.QUEUED:
            rows.end(row, JobState.CANCELLED)
        row.cancel_requested = running
    if running:
        service.dispatcher.cancel(job_id)
    service.feed.publish((job_id,))


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
        session.delete(find(session, job_id))
    service.store.drop_job(job_id)
    service.feed.publish((job_id,))


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
        row = session.execute(select(JobRow.state, JobRow.last_seq).where(JobRow.id == job_id)).first()
    if row is None:
        raise UnknownJobError
    return Standing(*row)


def progress_of(row: JobRow) -> Progress:
    """Describe how far a job is."""
    return Progress(done=row.done_steps, total=row.total_steps, share=rows.share(row))


def failure_of(row: JobRow) -> Failure | None:
    """Describe why a job failed, if it did."""
    return Failure.model_validate(row.failure) if row.failure else None


def _error_of(row: JobRow) -> ReachedError | None:
    """Describe the error that a job has reached, once it is known."""
    entries = row.pass_costs if row.target_error is None else row.merges
    known = entries[-1]["error"] if entries else None
    return ReachedError.model_validate(known) if known else None


def _document(session: Session, row: JobRow) -> Job:
    return Job(
        id=row.id,
        name=row.name,
        state=row.state,
        width=row.width,
        height=row.height,
        progress=progress_of(row),
        queue_position=_queue_position(session, row) if row.state is JobState.QUEUED else None,
        last_seq=row.last_seq,
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        failure=failure_of(row),
        cost=JobCost(
            predicted_cpu_seconds=row.predicted_cpu_seconds,
            cpu_seconds=row.cpu_seconds,
            rays=row.rays,
            work=Work.model_validate(row.work),
        ),
        numerics=_numerics(row),
        error=_error_of(row),
        warnings=tuple(Problem.model_validate(warning) for warning in row.warnings),
        links=_links(row),
    )


def _numerics(row: JobRow) -> Numerics | None:
    """What went wrong with numbers; none are known before the end, nor of jobs older than the counts."""
    known = row.state is JobState.SUCCEEDED and row.numerics
    return Numerics.model_validate(row.numerics) if known else None


def _queue_position(session: Session, row: JobRow) -> int:
    before = (JobRow.state == JobState.QUEUED, JobRow.number < row.number)
    return session.scalar(select(func.count()).select_from(JobRow).where(*before)) or 0


def _links(row: JobRow) -> JobLinks:
    path = f"/v1/jobs/{row.id}"
    return JobLinks(
        self=path,
        cancel=f"{path}/cancel",
        tiles=f"{path}/tiles",
        events=f"{path}/events",
        plan=f"{path}/plan",
        convergence=f"{path}/convergence",
        image_png=f"{path}/image.png",
        image_npy=f"{path}/image.npy",
        image_exr=f"{path}/image.exr",
        layers={name: f"{path}/layers/{name}.npy" for name in row.layers},
    )
