"""The log of a job, derived from its rows without a table of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from schemas.api.jobs import JobLog, JobState, LogEntry
from service.jobs import lifecycle as jobs
from service.jobs.context import Service
from service.lifecycle.documents import passes_of, work_of
from service.storage.database.models import JobRow, RenderRow, TileRow
from service.workers.heartbeats import SLICE_SECONDS
from service.workers.tasks import WHOLE_PICTURE

MOST_STEPS = 50
"""Most repeated steps that are listed, as many as problems of a request."""

ENDS = {
    JobState.SUCCEEDED: "The picture is finished.",
    JobState.CANCELLED: "It was cancelled.",
    JobState.EXPIRED: "The picture was deleted: the service keeps pictures for a limited time.",
}


def log_of(service: Service, job_id: str) -> JobLog:
    """Report the history of a job."""
    with service.database.reading() as session:
        row = jobs.find(session, job_id)
        repeated = _repeated(session, row.render)
        entries = tuple(_entries(row, repeated[:MOST_STEPS]))
    return JobLog(job=row.id, state=row.state, entries=entries, more=max(0, len(repeated) - MOST_STEPS))


def _repeated(session: Session, render: RenderRow | None) -> list[TileRow]:
    """Find the steps of a render that were tried more than once, or that a worker died of."""
    if render is None:
        return []
    query = select(TileRow).where(TileRow.render == render.number)
    if render.target_error is not None:
        # Merging numbers its attempts on from pass to pass.
        query = query.where(TileRow.tile != WHOLE_PICTURE)
    unusual = query.where(or_(TileRow.attempt > 1, TileRow.deaths > 0))
    return list(session.scalars(unusual.order_by(TileRow.pass_index, TileRow.tile)))


def _entries(row: JobRow, repeated: list[TileRow]) -> Iterator[LogEntry]:
    work, render, left = work_of(row), row.render, row.parting or {}
    size = f"{work['width']} x {work['height']} pixels"
    yield LogEntry(at=row.created_at, event="submitted", message=f"Submitted: {size}.")
    if (render.id if render else left.get("render", row.id)) != row.id:
        yield LogEntry(
            at=row.created_at,
            event="shared",
            message="An equal job exists already: both share one render.",
        )
    if row.started_at is not None:
        yield LogEntry(at=row.started_at, event="started", message="The first tile went to a worker.")
    yield from _passes(row, repeated)
    if render is not None:
        yield from _composing(render)
    if row.paused_at is not None and not row.state.final:
        yield LogEntry(at=row.paused_at, event="paused", message="The job was paused.")
    if row.state is JobState.EXPIRED:
        yield LogEntry(at=row.finished_at, event="succeeded", message=ENDS[JobState.SUCCEEDED])
        yield LogEntry(at=left.get("left_at"), event="expired", message=ENDS[JobState.EXPIRED])
    elif row.state.final:
        yield LogEntry(at=row.finished_at, event=row.state.value, message=_end(row))


def _passes(row: JobRow, repeated: list[TileRow]) -> Iterator[LogEntry]:
    """Report the passes in order, each after its repeated steps."""
    finished = {cost["pass_index"]: cost for cost in passes_of(row)}
    for index in sorted({*finished, *(step.pass_index for step in repeated)}):
        yield from (_step(step) for step in repeated if step.pass_index == index)
        if index in finished:
            yield _pass(finished[index])


def _step(step: TileRow) -> LogEntry:
    name = f"Tile {step.tile} of pass {step.pass_index}"
    return LogEntry(
        event="step_repeated",
        message=f"{name} was started {step.attempt} times. {_cause(step)}",
        pass_index=step.pass_index,
        tile=step.tile,
        attempts=step.attempt,
        workers_lost=step.deaths,
    )


def _cause(step: TileRow) -> str:
    if step.deaths:
        return f"{step.deaths} of its workers died."
    if (step.cpu_seconds or 0.0) > SLICE_SECONDS / 2:
        return "It takes longer than its turn, and continued each time."
    return "The service was stopped meanwhile."


def _pass(cost: dict[str, Any]) -> LogEntry:
    error = cost["error"]
    reached = f", error {error['estimate']:.2g}" if error else ""
    return LogEntry(
        at=cost["at"],
        event="pass_finished",
        message=f"Pass {cost['pass_index']} is finished: {cost['seconds']:.2f} s and "
        f"{cost['cpu_seconds']:.2f} CPU s so far, {sum(cost['rays'].values())} rays{reached}.",
        pass_index=cost["pass_index"],
    )


def _composing(render: RenderRow) -> Iterator[LogEntry]:
    # With target quality each pass is assembled, and repeating that is not reported apart.
    if render.target_error is None and render.compose_attempt > 1:
        yield LogEntry(
            event="composed_again",
            message=f"The tiles were assembled {render.compose_attempt} times: a worker died, or the "
            "service was stopped meanwhile.",
            attempts=render.compose_attempt,
        )


def _end(row: JobRow) -> str:
    if row.failure is not None:
        return f"{row.failure['message']} ({row.failure['code']})"
    return ENDS.get(row.state, "It has ended.")
