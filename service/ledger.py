"""The dispatcher's transactions: which step is next, and what became of those handed out.

Every function works in a transaction of its caller, so that the results and the claims of one round
are one write.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from datetime import UTC, datetime

from sqlalchemy import bindparam, exists, literal_column, or_, select, update
from sqlalchemy.orm import Session

from schemas.jobs import JobState
from service import pass_costs, rows, targets
from service.database.models import DONE, RUNNING, WAITING, JobRow, TileRow
from service.engines.tasks import ComposeDone, ComposeTask, JobTask, SampleTask, TileDone, TileTask
from service.store.tiles import StoredTile

# Built once: making a statement takes longer than executing it, and these run for every tile.
# SQLite uses the index of waiting steps only where the condition stands in the statement as in the index.
_IS_WAITING = TileRow.state == literal_column("'waiting'")
_STARTED = JobRow.state == JobState.RUNNING
_JOB = select(JobRow).where(JobRow.id == bindparam("id")).with_for_update()
_ACTIVE = (
    select(JobRow)
    .where(or_(_STARTED, JobRow.state == JobState.QUEUED), ~JobRow.cancel_requested)
    .where(exists().where(TileRow.job == JobRow.number, _IS_WAITING))
    .order_by(_STARTED, JobRow.number)
    .limit(bindparam("room"))
)
_WAITING = (
    select(TileRow)
    .where(TileRow.job == bindparam("job"), _IS_WAITING)
    .where(TileRow.pass_index <= bindparam("last_pass"))
    .order_by(TileRow.pass_index, TileRow.tile)
    .limit(bindparam("room"))
)
_RENDERED = (
    select(JobRow)
    .where(_STARTED, ~JobRow.cancel_requested, JobRow.done_steps == JobRow.total_steps)
    .order_by(JobRow.number)
)


def recover(session: Session) -> None:
    """Take back what a service that is gone had handed out: finished steps stay finished."""
    session.execute(update(TileRow).where(TileRow.state == RUNNING).values(state=WAITING))
    for job in session.scalars(select(JobRow).where(JobRow.state == JobState.RUNNING)):
        job.compose_attempt = 0
        if job.cancel_requested:
            rows.end(job, JobState.CANCELLED)


def job_of(session: Session, job_id: str) -> JobRow | None:
    """Find a job and keep others from changing it until the transaction ends."""
    return session.scalar(_JOB, {"id": job_id})


def tile_claims(session: Session, room: int) -> Iterator[TileTask]:
    """Hand out the next steps, at most ``room``.

    A queued job shows its coarse picture before any other job goes on; then the oldest job runs, all tiles
    in one pass before any tile in the next.
    """
    for job in session.scalars(_ACTIVE, {"room": room}).all() if room else ():
        last_pass = 0 if job.state == JobState.QUEUED else len(job.passes)
        steps = session.scalars(_WAITING, {"job": job.number, "last_pass": last_pass, "room": room})
        for step in steps.all():
            room -= 1
            yield _hand_out(job, step)
        if not room:
            return


def _hand_out(job: JobRow, step: TileRow) -> TileTask:
    if job.state == JobState.QUEUED:
        job.state = JobState.RUNNING
        job.started_at = datetime.now(UTC)
    step.state = RUNNING
    step.attempt += 1
    place = job.id, job.spec_sha256, rows.tile_of(step), rows.passes_of(job)[step.pass_index], step.attempt
    if job.target_error is None:
        return TileTask(*place)
    end = targets.deadline(job) if job.merges else None
    return SampleTask(*place, merged=targets.merged_by(job), until=end.timestamp() if end else None)


def land(session: Session, job: JobRow, task: TileTask, done: TileDone) -> bool:
    """Take note of a finished step. False if it is not the attempt that was waited for."""
    step = _handed_out(session, job, task)
    if step is None:
        return False
    job.last_seq += 1
    job.done_steps += 1
    job.done_work += (
        done.counts["camera"] if isinstance(task, SampleTask) else rows.work(task.pass_, task.tile)
    )
    job.cpu_seconds += done.cpu_seconds
    job.rays = _sum(job.rays, done.counts)
    job.work = _sum(job.work, done.work)
    if job.target_error is None:
        pass_costs.note(job, task.pass_.index, done)
    step.state, step.seq, step.crc32, step.cpu_seconds = DONE, job.last_seq, done.crc32, done.cpu_seconds
    return True


def _sum(so_far: dict[str, int], more: dict[str, int]) -> dict[str, int]:
    """Add counts; what was counted and is 0 stays in."""
    return {name: so_far.get(name, 0) + more.get(name, 0) for name in so_far | more}


def take_back(session: Session, job: JobRow, task: TileTask, *, death: bool) -> int:
    """Let a step wait again, and return how many workers it has cost so far."""
    step = _handed_out(session, job, task)
    if step is None:
        return 0
    step.state = WAITING
    step.deaths += death
    return step.deaths


def compose_claims(session: Session, composing: Collection[str]) -> Iterator[JobTask]:
    """Hand out what puts tiles together, where all of a job are finished, except those in ``composing``."""
    for job in session.scalars(_RENDERED).all():
        if job.id not in composing:
            job.compose_attempt += 1
            yield _compose_task(session, job)


def _compose_task(session: Session, job: JobRow) -> JobTask:
    if job.target_error is not None:
        return targets.advance_task(session, job)
    parts = tuple(sampled(session, job))
    return ComposeTask(
        job=job.id,
        width=job.width,
        height=job.height,
        parts=parts,
        attempt=job.compose_attempt,
        layers=tuple(job.layers),
        compared=job.error_unknown is None,
    )


def complete(job: JobRow, done: ComposeDone) -> None:
    """Take note of a final picture."""
    job.image_sha256 = done.sha256
    job.numerics = job.numerics | done.numerics
    pass_costs.note_errors(job, done.errors)
    rows.end(job, JobState.SUCCEEDED)


def sampled(session: Session, job: JobRow, tiles: Collection[int] | None = None) -> Iterator[StoredTile]:
    """Iterate over the finished steps that have samples, tile by tile, each in the order of its passes."""
    passes = rows.passes_of(job)
    query = select(TileRow).where(TileRow.job == job.number, TileRow.state == DONE, TileRow.pass_index > 0)
    if tiles is not None:
        query = query.where(TileRow.tile.in_(tiles))
    for step in session.scalars(query.order_by(TileRow.tile, TileRow.pass_index)):
        yield rows.stored(step, passes)


def coarse(session: Session, job: JobRow) -> StoredTile | None:
    """Return the coarse picture of a job, if it is finished."""
    step = session.get(TileRow, (job.number, 0, 0))
    return rows.stored(step, rows.passes_of(job)) if step and step.state == DONE else None


def _handed_out(session: Session, job: JobRow, task: TileTask) -> TileRow | None:
    if job.state != JobState.RUNNING or job.cancel_requested:
        return None
    step = session.get(TileRow, (job.number, task.pass_.index, task.tile.index))
    return step if step and step.state == RUNNING and step.attempt == task.attempt else None
