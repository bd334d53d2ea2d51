"""Passes of target quality: each is planned from the one before, until the error is reached.

A pass has tiles, numbered from 1. Merging them into the whole picture is recorded as a finished step with the
tile number 0. As in ``ledger.py``, every function runs in its caller's transaction.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import product
from typing import Any

from sqlalchemy import and_, delete, func, insert, or_, select
from sqlalchemy.orm import Session

from renderer.adaptive.forecast import Forecast
from renderer.adaptive.time_limits import reserve
from schemas.api.jobs import JobState
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile
from service.lifecycle import clock, fairness, rows
from service.lifecycle.damage import ROW_ERRORS, DamagedRenderError
from service.storage.database.models import DONE, WAITING, RenderRow, TileRow
from service.storage.tiles import StoredTile, pass_prefix
from service.workers.planning import Outline
from service.workers.tasks import WHOLE_PICTURE, AdvanceDone, AdvanceTask, pass_of

Step = tuple[Pass, Tile]

MOST_WORK = 1e15
"""Most total work of a render: without a bound, a pass that is predicted to add no progress makes it
infinite."""

# Only the time columns: there may be a row for each waiting job.
_LIMITED = select(
    RenderRow.number,
    RenderRow.time_limit,
    RenderRow.started_at,
    RenderRow.paused_at,
    RenderRow.paused_seconds,
    RenderRow.merges,
).where(
    RenderRow.state == JobState.RUNNING,
    RenderRow.time_limit.is_not(None),
    RenderRow.paused_at.is_(None),
    ~RenderRow.cancel_requested,
)


def begin(outline: Outline, target: TargetQuality, tile_size: int | None) -> dict[str, Any]:
    """Return the columns of a render before its first pass, for the passes that follow.

    Parameters
    ----------
    tile_size
        Pixels along a tile's side; by default the renderer chooses them for each pass.
    """
    assert outline.forecast is not None
    return {
        "total_work": _total_work(0, outline.rays, 0.0, _share(outline.forecast, 0.0)),
        "target_error": target.error,
        "time_limit": target.time_limit,
        "tile_size": tile_size,
    }


def _share(expected: Forecast, spent: float) -> float:
    """Predict the finished share of a render after its next pass."""
    return expected.share(spent + expected.next, 1.0)


def _total_work(counted: int, rays: int, before: float, after: float) -> int:
    """Return the total work for which these rays move the finished share from ``before`` to ``after``."""
    return counted + max(1, round(min(rays * (1.0 - before) / max(after - before, 1e-6), MOST_WORK)))


def merged_by(render: RenderRow) -> int:
    """Return the attempt that has merged the newest pass, 0 if none is merged."""
    return int(render.merges[-1]["attempt"]) if render.merges else 0


def time_left(render: RenderRow) -> float | None:
    """Return the seconds left to a render; None without a time limit, or if it has not begun."""
    if render.time_limit is None or render.started_at is None:
        return None
    return render.time_limit - rows.ran_for(render)


def tile_time_left(render: RenderRow) -> float | None:
    """Return the seconds left for tiles, so that there is time to merge them."""
    left = time_left(render)
    if left is None or not render.merges:
        return left
    assert render.time_limit is not None
    merging: float = max(past["merging_seconds"] for past in render.merges)
    return left - reserve(render.time_limit, merging)


def expire(session: Session) -> float | None:
    """Drop the waiting tiles of renders whose time is spent; return the seconds until the next one's.

    The first pass is rendered in any case: without it there is no picture.
    """
    upcoming = []
    limited: Any
    for limited in session.execute(_LIMITED).all():
        try:
            left = tile_time_left(limited)
        except ROW_ERRORS as error:
            raise DamagedRenderError(session.get_one(RenderRow, limited.number)) from error
        if left is not None and left > 0:
            upcoming.append(left)
            continue
        render = session.get_one(RenderRow, limited.number)
        if render.merges:
            unstarted = delete(TileRow).where(TileRow.render == render.number, TileRow.state == WAITING)
            render.total_steps -= len(session.execute(unstarted.returning(TileRow.tile)).all())
    return min(upcoming, default=None)


def quarter(session: Session, render: RenderRow, step: TileRow) -> None:
    """Divide a step into quarters, or into halves if it is one pixel wide or high; it becomes the first."""
    place = TileRow.render == render.number, TileRow.pass_index == step.pass_index
    newest = session.scalars(select(func.max(TileRow.tile)).where(*place)).one()
    first, *others = _quarters(rows.tile_of(step))
    step.x1, step.y1 = first.x1, first.y1
    for number, part in enumerate(others, newest + 1):
        values = rows.new_step(render.number, pass_of(step.pass_index), replace(part, index=number))
        # The tile number may be in use before `undo_merge`, so its attempt numbers must not repeat.
        session.add(TileRow(**values, attempt=step.attempt))
    render.total_steps += len(others)


def _quarters(tile: Tile) -> list[Tile]:
    x, y = (tile.x0 + tile.x1 + 1) // 2, (tile.y0 + tile.y1 + 1) // 2
    columns, lines = ((tile.x0, x), (x, tile.x1)), ((tile.y0, y), (y, tile.y1))
    parts = [Tile(tile.index, x0, y0, x1, y1) for (y0, y1), (x0, x1) in product(lines, columns)]
    return [part for part in parts if part.width and part.height]


def is_spent(render: RenderRow) -> bool:
    """Whether no time is left for tiles of a render."""
    left = tile_time_left(render)
    return left is not None and left <= 0


def advance_task(session: Session, render: RenderRow) -> AdvanceTask:
    """Make the task that merges the tiles of the newest pass."""
    return AdvanceTask(
        job=render.id,
        spec_sha256=render.spec_sha256,
        pass_=pass_of(len(render.merges)),
        parts=tuple(fresh(session, render)),
        merged=merged_by(render),
        tile_size=render.tile_size,
        last=is_spent(render),
        attempt=render.compose_attempt,
        layers=tuple(render.layers),
        recorded=tuple(recorded(session, render)) if render.layers else (),
        prices=render.merges[-1]["prices"] if render.merges else None,
        checksums=rows.checksums_of(render),
    )


def fresh(session: Session, render: RenderRow) -> list[StoredTile]:
    """Return the finished tiles of the unmerged pass."""
    return _finished(session, render, len(render.merges))


def recorded(session: Session, render: RenderRow) -> list[StoredTile]:
    """Return the finished tiles that have recorded the centres of pixels: those of the first pass."""
    return _finished(session, render, 0)


def _finished(session: Session, render: RenderRow, pass_index: int) -> list[StoredTile]:
    place = TileRow.render == render.number, TileRow.pass_index == pass_index
    query = select(TileRow).where(*place, TileRow.tile != WHOLE_PICTURE, TileRow.state == DONE)
    passes = rows.passes_of(render)
    return [rows.stored(step, passes) for step in session.scalars(query.order_by(TileRow.tile))]


def merge(session: Session, render: RenderRow, task: AdvanceTask, done: AdvanceDone) -> None:
    """Record a merged pass: the picture is finished, or the next pass begins."""
    _enter_whole(session, render, task, done)
    render.merges = [*render.merges, _record(render, task, done)]
    render.compose_deaths = 0
    if done.sha256 is None:
        render.checksums = _checksums(render, done)
        _begin_pass(session, render, task.pass_.index + 1, done)
    else:
        picture = rows.FinalPicture(done.sha256, task.attempt, done.numerics, done.checksums)
        rows.succeed(session, render, picture)


def undo_merge(session: Session, render: RenderRow) -> None:
    """Have the newest merged pass merged again after its files were lost.

    The store keeps what that needs. The tiles of the next pass are deleted, since merging determines them.
    """
    if not render.merges:
        return
    index = len(render.merges)
    merged = and_(TileRow.pass_index == index - 1, TileRow.tile == WHOLE_PICTURE)
    place = TileRow.render == render.number, or_(TileRow.pass_index == index, merged)
    for step in session.scalars(select(TileRow).where(*place)).all():
        render.total_steps -= 1
        render.done_steps -= step.state == DONE
        render.compose_attempt = max(render.compose_attempt, step.attempt)
        fairness.settle(session, step, 0.0)
        session.delete(step)
    session.flush()
    render.passes, render.merges = render.passes[:index], render.merges[:-1]


def _checksums(render: RenderRow, done: AdvanceDone) -> dict[str, Any]:
    """Return the checksums of the files of the two newest merged passes, which `undo_merge` needs."""
    before = pass_prefix(len(render.merges) - 2)
    kept = {name: found for name, found in (render.checksums or {}).items() if name.startswith(before)}
    return kept | rows.documents_of(done.checksums)


def _enter_whole(session: Session, render: RenderRow, task: AdvanceTask, done: AdvanceDone) -> None:
    render.last_seq += 1
    render.done_steps += 1
    render.total_steps += 1
    render.cpu_seconds += done.cpu_seconds
    picture = rows.new_step(render.number, task.pass_, Tile(WHOLE_PICTURE, 0, 0, render.width, render.height))
    session.add(
        TileRow(
            **picture, state=DONE, attempt=task.attempt, seq=render.last_seq, cpu_seconds=done.cpu_seconds
        )
    )


def _begin_pass(session: Session, render: RenderRow, index: int, done: AdvanceDone) -> None:
    before = max(rows.share(render), done.expected.share(render.cpu_seconds, 0.0))
    after = max(before, _share(done.expected, render.cpu_seconds))
    render.counted_share, render.counted_work = before, render.done_work
    render.total_work = _total_work(render.done_work, done.samples, before, after)
    pass_ = pass_of(index)
    render.passes = [*render.passes, asdict(pass_)]
    render.total_steps += len(done.tiles)
    # After `undo_merge` the steps in place of deleted ones must not use an attempt number again.
    tried = render.compose_attempt if render.damage_count else 0
    steps = (rows.new_step(render.number, pass_, tile) for tile in done.tiles)
    session.execute(insert(TileRow), [step | {"attempt": tried} for step in steps])
    fairness.activate_all_of(session, render)


def _record(render: RenderRow, task: AdvanceTask, done: AdvanceDone) -> dict[str, Any]:
    """Describe a merged pass: its attempt, its own cost, and the error and forecast after it."""
    assert render.started_at is not None
    seconds = clock.since(render.started_at)
    rays = {
        kind: count - sum(past["rays"].get(kind, 0) for past in render.merges)
        for kind, count in render.rays.items()
    }
    return {
        "attempt": task.attempt,
        "tiles": len(task.parts),
        "error": done.error,
        "seconds": seconds - sum(past["seconds"] for past in render.merges),
        "cpu_seconds": render.cpu_seconds - sum(past["cpu_seconds"] for past in render.merges),
        "rays": rays,
        "prices": done.prices,
        "ray_seconds": done.ray_seconds,
        "tile_seconds": done.expected.next / max(len(done.tiles), 1),
        "expected": asdict(done.expected) if done.tiles else None,
        "samples": done.samples,
        "merging_seconds": done.cpu_seconds,
    }
