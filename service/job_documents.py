"""Jobs as the outside sees them."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import bindparam, func, literal_column, select
from sqlalchemy.orm import Session

from schemas.jobs import Failure, Job, JobCost, JobLinks, JobState, Progress, TileAtWork
from schemas.problems import Problem
from service import progress
from service.database.models import JobRow, RenderRow, TileRow

# Built once, for it runs for each running job of a list. SQLite uses the index of running steps only where
# the condition stands in the statement as in the index.
_AT_WORK = (
    select(TileRow)
    .where(TileRow.render == bindparam("render"), TileRow.state == literal_column("'running'"))
    .order_by(TileRow.pass_index, TileRow.tile)
)


def document(session: Session, row: JobRow, keep_seconds: float | None = None) -> Job:
    """Describe a job as it is now; a picture is removed after ``keep_seconds``."""
    work = work_of(row)
    return Job(
        id=row.id,
        name=row.name,
        user=row.owner,
        labels=row.labels,
        priority=row.priority,
        state=row.state,
        paused=row.paused_at is not None and not row.state.final,
        width=work["width"],
        height=work["height"],
        quality=row.quality,
        progress=progress_of(row),
        rendering=_rendering(session, row),
        queue_position=_queue_position(session, row),
        last_seq=work["last_seq"],
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        expires_at=_expires_at(row, keep_seconds),
        pinned=row.pinned,
        failure=failure_of(row),
        cost=JobCost.model_validate(work["cost"] | {"predicted_cpu_seconds": row.predicted_cpu_seconds}),
        numerics=work["numerics"],
        error=work["error"],
        warnings=tuple(Problem.model_validate(warning) for warning in row.warnings),
        links=_links(row.id, work["layers"]),
    )


def _expires_at(row: JobRow, keep_seconds: float | None) -> datetime | None:
    if keep_seconds is None or row.finished_at is None or row.pinned or row.state is not JobState.SUCCEEDED:
        return None
    return row.finished_at + timedelta(seconds=keep_seconds)


def work_of(row: JobRow) -> dict[str, Any]:
    """Tell of the work for a job: of its render as it is now, or as it was when the job left it."""
    if row.render is not None:
        return _work(row.render)
    assert row.parting is not None
    return row.parting


def leave(row: JobRow) -> None:
    """Let a job go without its render, and keep what is told of it."""
    row.parting, row.render = work_of(row), None


def progress_of(row: JobRow) -> Progress:
    """Describe how far a job is."""
    known = work_of(row)["progress"]
    if row.state.final or row.paused_at is not None:
        known = known | {"remaining_seconds": None}
    return Progress.model_validate(known)


def failure_of(row: JobRow) -> Failure | None:
    """Describe why a job failed, if it did."""
    return Failure.model_validate(row.failure) if row.failure else None


def _work(render: RenderRow) -> dict[str, Any]:
    return {
        "width": render.width,
        "height": render.height,
        "layers": render.layers,
        "progress": {
            "done": render.done_steps,
            "total": render.total_steps,
            "share": progress.share(render),
            "remaining_seconds": progress.remaining_seconds(render),
        },
        "last_seq": render.last_seq,
        "cost": {"cpu_seconds": render.cpu_seconds, "rays": render.rays, "work": render.work},
        "numerics": _numerics(render),
        "error": _error(render),
    }


def _numerics(render: RenderRow) -> dict[str, int] | None:
    """What went wrong with numbers; none are known before the end, nor of jobs older than the counts."""
    return render.numerics or None if render.state is JobState.SUCCEEDED else None


def _error(render: RenderRow) -> dict[str, float] | None:
    """The error that has been reached, once it is known."""
    entries = render.pass_costs if render.target_error is None else render.merges
    return entries[-1]["error"] if entries else None


def _rendering(session: Session, row: JobRow) -> tuple[TileAtWork, ...]:
    if row.state is not JobState.RUNNING or row.render is None:
        return ()
    steps = session.scalars(_AT_WORK, {"render": row.render.number})
    return tuple(TileAtWork.model_validate(step, from_attributes=True) for step in steps)


def _queue_position(session: Session, row: JobRow) -> int | None:
    if row.state is not JobState.QUEUED or row.paused_at is not None:
        return None
    before = (JobRow.state == JobState.QUEUED, JobRow.paused_at.is_(None), JobRow.number < row.number)
    return session.scalar(select(func.count()).select_from(JobRow).where(*before)) or 0


def _links(job_id: str, layers: list[str]) -> JobLinks:
    path = f"/v1/jobs/{job_id}"
    return JobLinks(
        self=path,
        cancel=f"{path}/cancel",
        pause=f"{path}/pause",
        resume=f"{path}/resume",
        tiles=f"{path}/tiles",
        events=f"{path}/events",
        plan=f"{path}/plan",
        convergence=f"{path}/convergence",
        image_png=f"{path}/image.png",
        image_npy=f"{path}/image.npy",
        image_exr=f"{path}/image.exr",
        layers={name: f"{path}/layers/{name}.npy" for name in layers},
    )
