"""Rows of renders, jobs and steps: how they begin and end, what a step costs, how long a render has run."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, NamedTuple

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from schemas.api.jobs import Failure, JobState
from schemas.tiles import Pass, Tile
from service.lifecycle import clock, totals
from service.storage.checksums import Checksum, Expected, restored
from service.storage.database.models import JobRow, RenderRow, TileRow
from service.storage.tiles import Checksums, StoredTile, final_prefix

FIRST_PASS = 1 / 16
"""Approximate share of the price for the first pass of target quality."""

OPEN = (JobState.QUEUED, JobState.RUNNING)
"""States of jobs that are not finished."""


class FinalPicture(NamedTuple):
    """The files of a final picture: which attempt has written them, and their checksums.

    ``sha256`` is that of the picture, and ``numerics`` counts its bad pixels by kind.
    """

    sha256: str
    attempt: int
    numerics: dict[str, int]
    checksums: Checksums


def begin(session: Session, render: RenderRow) -> None:
    """Start a render and the jobs that share it."""
    render.state, render.started_at = JobState.RUNNING, clock.now()
    _update_jobs(session, render, state=render.state, started_at=render.started_at)


def end(session: Session, render: RenderRow, state: JobState, failure: Failure | None = None) -> None:
    """Give a render and the jobs that share it their final state."""
    render.state = state
    document = failure.model_dump() if failure else None
    ended = _update_jobs(session, render, state=state, failure=document, finished_at=datetime.now(UTC))
    if failure is not None:
        totals.add_failed(session, failure.code, ended)


def succeed(session: Session, render: RenderRow, picture: FinalPicture) -> None:
    """Record a final picture, which files it is in and how large they are."""
    render.image_sha256, render.final_prefix = picture.sha256, final_prefix(picture.attempt)
    render.numerics = render.numerics | picture.numerics
    render.checksums = documents_of(picture.checksums)
    if render.stored_bytes is not None:
        render.stored_bytes += sum(checksum.size for checksum in picture.checksums.values())
        totals.add(session, totals.STORED_BYTES, render.stored_bytes)
    end(session, render, JobState.SUCCEEDED)
    note_idle(session, render)


def documents_of(checksums: Checksums) -> dict[str, Any]:
    """Describe checksums as `checksums_of` reads them."""
    return {name: checksum.document() for name, checksum in checksums.items()}


def checksums_of(render: RenderRow) -> dict[str, Checksum]:
    """Return the checksums of the files of a render, as far as they are known."""
    return {name: restored(document) for name, document in (render.checksums or {}).items()}


def expected(render: RenderRow, name: str) -> Expected:
    """Return the checksum or the SHA-256 of a file of a final picture."""
    if render.checksums is None:
        # The picture of an earlier version.
        return render.image_sha256 if name == f"{render.final_prefix}image.npy" else None
    return checksums_of(render).get(name)


def note_idle(session: Session, render: RenderRow) -> None:
    """Record when the last job of a finished render ended; never for a pinned one."""
    jobs = select(func.max(JobRow.finished_at), func.count().filter(JobRow.pinned))
    newest, pins = session.execute(jobs.where(JobRow.render_number == render.number)).one()
    render.idle_since = None if pins else newest


def end_alone(session: Session, job: JobRow, state: JobState, failure: Failure | None = None) -> None:
    """Give a final state to a job that has left its render."""
    job.state, job.finished_at = state, datetime.now(UTC)
    job.failure = failure.model_dump() if failure else None
    if failure is not None:
        totals.add_failed(session, failure.code, 1)


def _update_jobs(session: Session, render: RenderRow, **changes: Any) -> int:
    """Change the open jobs of a render, and count them."""
    sharing = JobRow.render_number == render.number, JobRow.state.in_(OPEN)
    changed = update(JobRow).where(*sharing).values(**changes).returning(JobRow.number)
    return len(session.execute(changed).all())


def work(pass_: Pass, tile: Tile) -> int:
    """Camera samples of a step: the unit in which progress is measured."""
    if pass_.stride > 1:
        return -(-tile.width // pass_.stride) * -(-tile.height // pass_.stride)
    return (pass_.last - pass_.first) * tile.width * tile.height


def expected_cpu_seconds(render: RenderRow, step: TileRow) -> float:
    """Predict the cost of a step: its part of the price, or what its pass predicts."""
    if render.target_error is not None:
        if render.merges:
            return float(render.merges[-1]["tile_seconds"])
        tile = tile_of(step)
        part = FIRST_PASS * tile.width * tile.height / (render.width * render.height)
    else:
        part = work(passes_of(render)[step.pass_index], tile_of(step)) / render.total_work
    return render.predicted_cpu_seconds * min(1.0, part)


def ran_for(row: JobRow | RenderRow) -> float:
    """Return the seconds that a started job or render has run, without pauses.

    Of its columns ``started_at``, ``paused_at`` and ``paused_seconds`` are enough.
    """
    assert row.started_at is not None
    return clock.since(row.started_at) - paused_for(row)


def paused_for(row: JobRow | RenderRow) -> float:
    """Return the seconds that a job or render has been paused since it started."""
    if row.paused_at is None or row.started_at is None:
        return row.paused_seconds
    return row.paused_seconds + min(clock.since(row.paused_at), clock.since(row.started_at))


def share(render: RenderRow) -> float:
    """Return the finished share of a render, 0 to 1; it never decreases, though a total may grow."""
    if render.state == JobState.SUCCEEDED:
        return 1.0
    before = render.counted_share
    part = (render.done_work - render.counted_work) / (render.total_work - render.counted_work)
    return min(1.0, before + (1.0 - before) * part)


def new_step(render: int, pass_: Pass, tile: Tile) -> dict[str, int | str]:
    """Make the row of a waiting step."""
    return {
        "render": render,
        "pass_index": pass_.index,
        "tile": tile.index,
        "x0": tile.x0,
        "y0": tile.y0,
        "x1": tile.x1,
        "y1": tile.y1,
    }


def stored(step: TileRow, passes: list[Pass]) -> StoredTile:
    """Locate the pixels of a finished step."""
    assert step.crc32 is not None
    return StoredTile(tile_of(step), passes[step.pass_index], step.attempt, step.crc32)


def tile_of(step: TileRow) -> Tile:
    """Return the tile of a step."""
    return Tile(step.tile, step.x0, step.y0, step.x1, step.y1)


def passes_of(render: RenderRow) -> list[Pass]:
    """Return the passes of a render."""
    return [Pass(**fields) for fields in render.passes]
