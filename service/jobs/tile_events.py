"""The tile events of a job after a number, as JSON and as a binary batch with pixels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import IO

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from renderer.images import files as image_files
from schemas.api.batches import FLOAT16, FLOAT32, RGB8, BatchHead, TileHead
from schemas.api.jobs import Job, JobState, TileBatch, TileEvent
from schemas.scene import Display
from service.dispatch import adaptive_passes as adaptive
from service.dispatch import ledger
from service.jobs.bands import BAND_PIXELS, means
from service.jobs.context import Service
from service.jobs.damaged_files import IMAGE, note_loss
from service.jobs.lifecycle import find, shown
from service.jobs.pictures import finished_of, target_pixels, unnamed, visible_events, wanted
from service.lifecycle import damage, rows
from service.lifecycle.documents import failure_of, progress_of
from service.storage.checksums import LOSS_ERRORS
from service.storage.database.models import JobRow, RenderRow, TileRow
from service.storage.objects import Stored
from service.storage.tiles import Pixels, StoredTile, TileStore

ENCODINGS = {"float32": FLOAT32, "float16": FLOAT16, "rgb8": RGB8}
VALUE_BYTES = {FLOAT32: 4, FLOAT16: 2, RGB8: 1}
MAX_ATTEMPTS = 3
"""Attempts at a batch: a pass may be merged during the first, and the job end during the second."""


def batch(service: Service, job_id: str, after: int) -> TileBatch:
    """Return the events after a number, as many as one answer holds."""
    with service.database.reading() as session:
        row = find(session, job_id)
        return _batch(session, row, after, service.settings.max_events)


def batch_and_end(service: Service, job_id: str, after: int) -> tuple[TileBatch, Job | None]:
    """Return the same, and the job where no event follows: it may be deleted a moment later."""
    with service.database.reading() as session:
        found = _batch(session, find(session, job_id), after, service.settings.max_events)
        return found, shown(session, job_id, service.settings) if found.complete else None


def _batch(session: Session, row: JobRow, after: int, limit: int) -> TileBatch:
    with damage.reading(row.id):
        return _events_of(session, row, after, limit)


def _events_of(session: Session, row: JobRow, after: int, limit: int) -> TileBatch:
    events = _events(session, row.render, after, limit) if row.render else ()
    following = events[-1].seq if events else after
    newest = row.render.last_seq if row.render else 0
    return TileBatch(
        state=row.state,
        progress=progress_of(row),
        events=events,
        next=following,
        # The newest event is missing where its tile was to be rendered again when the job ended.
        complete=row.state.final and (following >= newest or len(events) < limit),
        failure=failure_of(row),
    )


def _events(session: Session, render: RenderRow, after: int, limit: int) -> tuple[TileEvent, ...]:
    strides = [fields["stride"] for fields in render.passes]
    query = select(TileRow).where(TileRow.render == render.number, TileRow.seq > after)
    steps = session.scalars(query.order_by(TileRow.seq).limit(limit)).all()
    return tuple(_event(step, strides[step.pass_index]) for step in steps)


def _event(step: TileRow, stride: int) -> TileEvent:
    assert step.seq is not None
    return TileEvent(
        seq=step.seq,
        tile=step.tile,
        pass_index=step.pass_index,
        stride=stride,
        x0=step.x0,
        y0=step.y0,
        x1=step.x1,
        y1=step.y1,
    )


def etag(service: Service, job_id: str, after: int, encoding: int) -> str | None:
    """Return the tag of a batch of a final picture: its tiles never change. None before."""
    with service.database.reading() as session:
        render = find(session, job_id).render
        final = render.image_sha256 if render else None
    return final and f'"{final}-{after}-{encoding}"'


@dataclass(frozen=True)
class _News:
    """Finished tiles at one reading of the database, as a batch needs them."""

    state: JobState
    render: RenderRow | None
    events: TileBatch
    coarse: StoredTile | None
    parts: tuple[StoredTile, ...]


def pixels_of(events: Sequence[TileEvent]) -> int:
    """Count the pixels that a batch of these events has, about: each tile once."""
    newest = {event.tile: event for event in events}
    areas = ((event.x1 - event.x0) * (event.y1 - event.y0) // event.stride**2 for event in newest.values())
    return sum(areas)


def pixel_batch(service: Service, job_id: str, after: int, encoding: int) -> Stored:
    """Return the events after a number with their pixels, in the form of ``schemas.api.batches``.

    They are written to a file: readers may be slow, and a batch may have all pixels of a large picture.
    """
    for _ in range(MAX_ATTEMPTS):
        with service.database.reading() as session:
            news = _news(session, find(session, job_id), after, service.settings.max_events)
        try:
            return unnamed(service.settings.data, partial(_write, service, news, encoding))
        except LOSS_ERRORS as error:
            loss = error
            _note_loss(service, job_id, news, error)
    raise loss


def _note_loss(service: Service, job_id: str, news: _News, error: Exception) -> None:
    """Handle lost tiles, unless the job has ended meanwhile and deleted them."""
    with service.database.reading() as session:
        row = find(session, job_id)
        if row.state.final and news.state is not JobState.SUCCEEDED:
            return
        finished = finished_of(session, row)
    with suppress(FileNotFoundError):
        note_loss(service, finished, error)


def _write(service: Service, news: _News, encoding: int, file: IO[bytes]) -> None:
    head = BatchHead(
        encoding=encoding,
        tiles=0,
        next=news.events.next,
        complete=news.events.complete,
        succeeded=news.state is JobState.SUCCEEDED,
    )
    file.write(head.pack())
    tiles = 0
    if news.render is not None:
        display = Display.model_validate(news.render.display)
        for event, pixels in wanted(_pixels(service, news.render, news)):
            _write_parcel(file, event, pixels, display, encoding)
            tiles += 1
    # The number of tiles is known at the end.
    file.seek(0)
    file.write(head._replace(tiles=tiles).pack())


def _news(session: Session, row: JobRow, after: int, limit: int) -> _News:
    events, render = _batch(session, row, after, limit), row.render
    if row.state.final or render is None:
        return _News(row.state, render, events, None, ())
    if render.target_error is not None:
        return _News(row.state, render, events, None, tuple(adaptive.fresh(session, render)))
    tiles = {event.tile for event in events.events if event.pass_index > 0}
    parts = tuple(ledger.sampled(session, render, tiles))
    # A preview that comes late, after its worker died, must not replace better pixels.
    first = bool(events.events) and events.events[0].seq == 1 and events.events[0].pass_index == 0
    coarse = ledger.coarse(session, render) if first else None
    return _News(row.state, render, events, coarse, parts)


def _pixels(service: Service, render: RenderRow, news: _News) -> Iterator[tuple[TileEvent, Pixels]]:
    events = news.events.events
    if news.state is JobState.SUCCEEDED:
        name = f"{render.final_prefix}{IMAGE}"
        image = service.store.get_array(render.id, name, rows.expected(render, name))
        shown = _newest(render, events)
        return ((event, image[event.y0 : event.y1, event.x0 : event.x1]) for event in shown)
    if news.state.final:
        return iter(())
    if render.target_error is not None:
        return target_pixels(service, render, events, news.parts)
    return _so_far(service.store, render, news)


def _newest(render: RenderRow, events: Sequence[TileEvent]) -> Sequence[TileEvent]:
    """The events that no later one covers, without previews."""
    if render.target_error is not None:
        return visible_events(events)
    newest = {event.tile: event for event in events if event.pass_index > 0}
    return sorted(newest.values(), key=lambda event: event.seq)


def _so_far(store: TileStore, render: RenderRow, news: _News) -> Iterator[tuple[TileEvent, Pixels]]:
    newest = {event.tile: event for event in news.events.events if event.pass_index > 0}
    if news.coarse is not None:
        yield news.events.events[0], store.get_tile(render.id, news.coarse)
    parts = sorted(news.parts, key=lambda part: (newest[part.tile.index].seq, part.pass_.index))
    for tile, pixels in means(store, render.id, parts):
        yield newest[tile.index], pixels


def _write_parcel(file: IO[bytes], event: TileEvent, pixels: Pixels, display: Display, encoding: int) -> None:
    height, width, channels = pixels.shape
    head = TileHead(
        seq=event.seq,
        pass_index=event.pass_index,
        x0=event.x0,
        y0=event.y0,
        x1=event.x1,
        y1=event.y1,
        stride=event.stride,
        length=height * width * channels * VALUE_BYTES[encoding],
    )
    file.write(head.pack())
    rows = max(1, BAND_PIXELS // width)
    for top in range(0, height, rows):
        file.write(_encoded(pixels[top : top + rows], display, encoding))


def _encoded(band: Pixels, display: Display, encoding: int) -> bytes:
    if encoding == RGB8:
        return image_files.displayed(band, display).tobytes()
    if encoding == FLOAT32:
        return band.astype("<f4").tobytes()
    # Finite values stay finite, and infinite ones infinite.
    most = np.finfo(np.float16).max
    return np.where(np.isfinite(band), band.clip(-most, most), band).astype("<f2").tobytes()
