"""Documents that describe jobs."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from itertools import groupby
from typing import Any

from sqlalchemy import bindparam, literal_column, select
from sqlalchemy.orm import Session

from schemas.api.jobs import Failure, Job, JobCost, JobLinks, JobState, Numerics, Progress, TileAtWork
from schemas.errors import Problem
from service.errors import damaged
from service.lifecycle import clock, damage, fairness, progress, rows
from service.lifecycle.damage import UnreadableRow
from service.storage.database.models import JobRow, RenderRow, TileRow

# SQLite uses the index of running steps only where the condition stands in the statement as in the index.
_AT_WORK = (
    select(TileRow)
    .where(
        TileRow.render.in_(bindparam("renders", expanding=True)),
        TileRow.state == literal_column("'running'"),
    )
    .order_by(TileRow.render, TileRow.pass_index, TileRow.tile)
)


def documents(
    session: Session, jobs: Sequence[JobRow | UnreadableRow], keep_seconds: float | None = None
) -> tuple[Job, ...]:
    """Describe jobs as they are now, with a constant number of queries; damaged ones take some more.

    Parameters
    ----------
    keep_seconds
        Age at which a picture is removed.
    """
    readable = [row for row in jobs if isinstance(row, JobRow)]
    before, at_work = fairness.positions(session, readable), _at_work(session, readable)
    found = []
    for row in jobs:
        if isinstance(row, UnreadableRow):
            found.append(damage.describe(session, row.number, row.error, _links))
            continue
        rendering = at_work.get(row.render_number, ())
        try:
            found.append(_document(row, keep_seconds, before.get(row.number), rendering))
        except damage.ROW_ERRORS as error:
            found.append(damage.describe(session, row.number, error, _links))
    return tuple(found)


def _document(
    row: JobRow, keep_seconds: float | None, position: int | None, rendering: Sequence[TileRow]
) -> Job:
    work = work_of(row)
    return Job(
        id=row.id,
        name=row.name,
        user=row.owner,
        labels=row.labels,
        priority=row.priority,
        state=row.state,
        paused=row.paused_at is not None and not row.state.final,
        cancelling=row.render is not None and row.render.cancel_requested and not row.state.final,
        width=work["width"],
        height=work["height"],
        quality=row.quality,
        progress=_progress(row, work),
        rendering=tuple(TileAtWork.model_validate(step, from_attributes=True) for step in rendering),
        queue_position=position,
        last_seq=work["last_seq"],
        created_at=row.created_at,
        started_at=row.started_at,
        run_seconds=_run_seconds(row),
        finished_at=row.finished_at,
        expires_at=_expires_at(row, keep_seconds),
        pinned=row.pinned,
        failure=failure_of(row),
        cost=JobCost.model_validate(work["cost"] | {"predicted_cpu_seconds": row.predicted_cpu_seconds}),
        numerics=work["numerics"],
        error=work["error"],
        warnings=tuple(Problem.model_validate(warning) for warning in row.warnings),
        links=_links(row.id, work["layers"]),
        damage=damaged(row.render.damage) if row.render and row.render.damage else None,
    )


def _run_seconds(row: JobRow) -> float | None:
    if row.started_at is None:
        return None
    if row.finished_at is None:
        return rows.ran_for(row)
    stopped = row.paused_at or row.finished_at
    return max(0.0, (stopped - row.started_at).total_seconds() - row.paused_seconds)


def _expires_at(row: JobRow, keep_seconds: float | None) -> datetime | None:
    if keep_seconds is None or row.finished_at is None or row.pinned or row.state is not JobState.SUCCEEDED:
        return None
    return row.finished_at + timedelta(seconds=keep_seconds)


def work_of(row: JobRow) -> dict[str, Any]:
    """Report the work for a job: that of its render now, or when the job left it."""
    if row.render is not None:
        return _work(row.render)
    assert row.parting is not None
    return row.parting


def leave(row: JobRow) -> None:
    """Detach a job from its render, and keep its reported values."""
    kept = {"render": row.render and row.render.id, "passes": passes_of(row), "left_at": str(clock.now())}
    row.parting, row.render = work_of(row) | kept, None


def passes_of(row: JobRow) -> list[dict[str, Any]]:
    """Report the finished passes for a job, now or when it left its render, and when each ended.

    The times of requests of other users for the same picture stay private.
    """
    render = row.render
    if render is None:
        # Version 0.1 has kept none.
        passes: list[dict[str, Any]] = (row.parting or {}).get("passes", [])
        return passes
    found = []
    for cost in progress.finished_passes(render):
        at = render.started_at and render.started_at + timedelta(seconds=cost["seconds"])
        found.append(cost | {"at": str(at) if at and at >= row.created_at else None})
    return found


def progress_of(row: JobRow) -> Progress:
    """Describe the progress of a job."""
    return _progress(row, work_of(row))


def _progress(row: JobRow, work: dict[str, Any]) -> Progress:
    known = work["progress"]
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
    """Counts of invalid numbers; they are known at the end, and not of renders older than one of them."""
    known = render.state is JobState.SUCCEEDED and Numerics.model_fields.keys() <= render.numerics.keys()
    return render.numerics if known else None


def _error(render: RenderRow) -> dict[str, float] | None:
    """The error that has been reached, once it is known."""
    entries = render.pass_costs if render.target_error is None else render.merges
    return entries[-1]["error"] if entries else None


def _at_work(session: Session, jobs: Sequence[JobRow]) -> dict[int | None, list[TileRow]]:
    """Return the steps that workers have in hand, by the numbers of the renders of running jobs."""
    renders = {row.render_number for row in jobs if row.state is JobState.RUNNING and row.render is not None}
    if not renders:
        return {}
    steps = session.scalars(_AT_WORK, {"renders": list(renders)})
    return {render: list(of_render) for render, of_render in groupby(steps, lambda step: step.render)}


def _links(job_id: str, layers: Sequence[str] = ()) -> JobLinks:
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
        log=f"{path}/log",
        request=f"{path}/request",
        inspections=f"{path}/inspections",
        focus=f"{path}/focus",
        pin=f"{path}/pin",
        image_png=f"{path}/image.png",
        image_npy=f"{path}/image.npy",
        image_exr=f"{path}/image.exr",
        layers={name: f"{path}/layers/{name}.npy" for name in layers},
    )
