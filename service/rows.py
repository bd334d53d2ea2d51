"""Rows of jobs and steps: how they begin, what they say, and how they end."""

from __future__ import annotations

from datetime import UTC, datetime

from schemas.jobs import Failure, JobState
from schemas.tiles import Pass, Tile
from service.database.models import JobRow, TileRow
from service.store.tiles import StoredTile


def end(job: JobRow, state: JobState, failure: Failure | None = None) -> None:
    """Give a job its final state."""
    job.state = state
    job.failure = failure.model_dump() if failure else None
    job.finished_at = datetime.now(UTC)


def work(pass_: Pass, tile: Tile) -> int:
    """Camera samples of a step: the unit in which progress is measured."""
    if pass_.stride > 1:
        return -(-tile.width // pass_.stride) * -(-tile.height // pass_.stride)
    return (pass_.last - pass_.first) * tile.width * tile.height


def share(job: JobRow) -> float:
    """Say which part of a job is done, 0 to 1; it never goes back, though a total may grow."""
    if job.state == JobState.SUCCEEDED:
        return 1.0
    before = job.counted_share
    part = (job.done_work - job.counted_work) / (job.total_work - job.counted_work)
    return min(1.0, before + (1.0 - before) * part)


def new_step(job: int, pass_: Pass, tile: Tile) -> dict[str, int | str]:
    """Make the row of a step that waits."""
    return {
        "job": job,
        "pass_index": pass_.index,
        "tile": tile.index,
        "x0": tile.x0,
        "y0": tile.y0,
        "x1": tile.x1,
        "y1": tile.y1,
    }


def stored(step: TileRow, passes: list[Pass]) -> StoredTile:
    """Say where the pixels of a finished step lie."""
    assert step.crc32 is not None
    return StoredTile(tile_of(step), passes[step.pass_index], step.attempt, step.crc32)


def tile_of(step: TileRow) -> Tile:
    """Give the tile of a step."""
    return Tile(step.tile, step.x0, step.y0, step.x1, step.y1)


def passes_of(job: JobRow) -> list[Pass]:
    """Give the passes of a job."""
    return [Pass(**fields) for fields in job.passes]
