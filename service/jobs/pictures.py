"""The picture of a job and its layers.

Final ones come from their files; before that they are composed of the finished tiles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np
from sqlalchemy.orm import Session

from renderer import film
from renderer.images import files as image_files
from schemas.api.jobs import JobState, TileEvent
from schemas.scene import Display
from schemas.tiles import Tile
from service.dispatch import adaptive_passes as targets
from service.dispatch import ledger
from service.errors import (
    PictureGoneError,
    PictureNotReadyError,
    StoreAwayError,
    StoreFullError,
    StoreReadOnlyError,
    UnknownLayerError,
)
from service.jobs.context import Service
from service.jobs.lifecycle import find
from service.lifecycle import progress, rows
from service.lifecycle.documents import work_of
from service.storage.database.models import JobRow, RenderRow
from service.storage.objects import Stored
from service.storage.tiles import Layers, Pixels, StoredTile, TileStore
from service.workers import layers
from service.workers.tasks import WHOLE

Kind = Literal["png", "npy", "exr"]
MEDIA_TYPES: dict[Kind, str] = {"png": "image/png", "npy": "application/octet-stream", "exr": "image/x-exr"}


@dataclass(frozen=True)
class ImageRequest:
    """A requested file of a job: its picture, a thumbnail, or a layer."""

    kind: Kind
    layer: str | None = None
    width: int | None = None

    @property
    def name(self) -> str:
        """Name of the file in the store once it is final, without the prefix of its attempt."""
        if self.width:
            return f"image-{self.width}.{self.kind}"
        return layers.file_name(self.layer) if self.layer else f"image.{self.kind}"


@dataclass(frozen=True)
class Picture:
    """A picture ready to be sent.

    ``content`` lies in the store once the picture is final. ``etag`` changes with every byte; ``share`` of
    the samples are in it, 0 to 1.
    """

    content: bytes | Stored
    etag: str
    share: float


@dataclass(frozen=True)
class _Finished:
    """What was finished when the database was read."""

    job: str
    render: RenderRow
    coarse: StoredTile | None
    parts: tuple[StoredTile, ...]
    recorded: tuple[StoredTile, ...]
    """The finished steps that may have recorded layers."""


def etag_of(service: Service, job_id: str, requested: ImageRequest) -> str | None:
    """Return the tag that the file would have now, without making it."""
    with service.database.reading() as session:
        row = _find(session, job_id, requested)
        render = row.render
        return (
            _etag(job_id, render, requested) if render and (render.image_sha256 or render.last_seq) else None
        )


def picture(service: Service, job_id: str, requested: ImageRequest) -> Picture:
    """Return the picture of a job, or one of its layers, as it is now.

    Raises
    ------
    UnknownLayerError
        If this layer was not requested for the job.
    PictureNotReadyError
        If nothing is finished yet.
    PictureGoneError
        If the job failed or was cancelled.
    """
    try:
        return _picture(service, job_id, requested)
    except FileNotFoundError:
        # The job has ended meanwhile: its tiles are in the final picture, or deleted.
        return _picture(service, job_id, requested)


def _picture(service: Service, job_id: str, requested: ImageRequest) -> Picture:
    with service.database.reading() as session:
        finished = _finished(session, _find(session, job_id, requested))
    job, render = finished.job, finished.render
    if render.image_sha256 is not None:
        return Picture(_final(service.store, render, requested), _etag(job, render, requested), 1.0)
    if requested.layer:
        return _layer_so_far(service.store, finished, requested, requested.layer)
    pixels = _so_far(service, finished)
    sheets = _layers_so_far(service.store, finished, render.layers if requested.kind == "exr" else ())
    return Picture(
        _encode(pixels, sheets, render, requested), _etag(job, render, requested), progress.share(render)
    )


def _find(session: Session, job_id: str, requested: ImageRequest) -> JobRow:
    row = find(session, job_id)
    names = work_of(row)["layers"]
    if requested.layer and requested.layer not in names:
        asked = ", ".join(names) or "none"
        raise UnknownLayerError(f"This job has no such layer. The requested layers are: {asked}.")
    return row


def _finished(session: Session, row: JobRow) -> _Finished:
    render = row.render
    if render is None or row.state in (JobState.FAILED, JobState.CANCELLED):
        raise PictureGoneError(f"There is no picture. The job ended as {row.state.value}.")
    if render.image_sha256 is not None:
        return _Finished(row.id, render, None, (), ())
    if render.last_seq == 0:
        raise PictureNotReadyError("No part of the picture is finished yet. Try again in a moment.")
    if render.target_error is not None:
        fresh, recorded = targets.fresh(session, render), targets.recorded(session, render)
        return _Finished(row.id, render, None, tuple(fresh), tuple(recorded))
    parts = tuple(ledger.sampled(session, render))
    return _Finished(row.id, render, ledger.coarse(session, render), parts, parts)


def _etag(job: str, render: RenderRow, requested: ImageRequest) -> str:
    # A render has the name of a job, which may belong to another user.
    return f'"{render.image_sha256 or f"{job}-{render.last_seq}"}-{requested.name}"'


def _final(store: TileStore, render: RenderRow, requested: ImageRequest) -> bytes | Stored:
    prefix = render.final_prefix
    found = store.find(render.id, prefix + requested.name)
    if found is not None:
        return found
    pixels = store.get_array(render.id, f"{prefix}image.npy")
    names = render.layers if requested.kind == "exr" else ()
    sheets = {name: store.get_array(render.id, prefix + layers.file_name(name)) for name in names}
    data = _encode(pixels, sheets, render, requested)
    try:
        store.put_file(render.id, prefix + requested.name, data)
        return store.find(render.id, prefix + requested.name) or data
    except (StoreFullError, StoreReadOnlyError, StoreAwayError):
        # The next request makes it again.
        return data


def _encode(pixels: Pixels, sheets: Layers, render: RenderRow, requested: ImageRequest) -> bytes:
    display = Display.model_validate(render.display)
    if requested.width:
        return image_files.encode_thumbnail(pixels, display, requested.width)
    return image_files.encode(f".{requested.kind}", pixels, display, sheets)


def _layer_so_far(store: TileStore, finished: _Finished, requested: ImageRequest, name: str) -> Picture:
    render, parts = finished.render, layers.recorded(finished.recorded, (name,))
    if render.target_error is not None and not layers.of_centres(name):
        raise PictureNotReadyError("With target quality this layer is there when the picture is finished.")
    if not parts:
        raise PictureNotReadyError("No part of the layer is finished yet. Try again in a moment.")
    sheet = _layers_so_far(store, finished, (name,))[name]
    passes = [pass_ for pass_ in rows.passes_of(render) if layers.records(pass_, (name,))]
    total = sum(rows.work(pass_, Tile(0, 0, 0, render.width, render.height)) for pass_ in passes)
    share = sum(rows.work(part.pass_, part.tile) for part in parts) / total
    return Picture(image_files.encode_layer(sheet), _etag(finished.job, render, requested), share)


def _layers_so_far(store: TileStore, finished: _Finished, names: Sequence[str]) -> Layers:
    render = finished.render
    return layers.composed(store, render.id, (render.height, render.width), names, finished.recorded)


def _so_far(service: Service, finished: _Finished) -> Pixels:
    render, store = finished.render, service.store
    if render.target_error is not None:
        return _target_so_far(service, render, finished.parts)
    image = np.zeros((render.height, render.width, 3), np.float32)
    if finished.coarse is not None:
        stride = finished.coarse.pass_.stride
        image[:] = film.enlarge(
            store.get_tile(render.id, finished.coarse), stride, render.height, render.width
        )
    for tile, pixels in means(store, render.id, finished.parts):
        image[tile.y0 : tile.y1, tile.x0 : tile.x1] = pixels
    return image


def means(store: TileStore, job_id: str, parts: Sequence[StoredTile]) -> Iterator[tuple[Tile, Pixels]]:
    """Yield the mean of all samples of each tile; its finished passes are given in order."""
    found = zip(parts, store.get_tiles(job_id, parts), strict=True)
    for _, group in groupby(found, key=lambda one: one[0].tile.index):
        steps = list(group)
        yield steps[0][0].tile, film.compose([(part.pass_, pixels) for part, pixels in steps])


def _target_so_far(service: Service, render: RenderRow, fresh: Sequence[StoredTile]) -> Pixels:
    """Paint the finished tiles of the pass that is not merged yet over the newest merged picture."""
    image = np.zeros((render.height, render.width, 3), np.float32)
    if render.merges:
        image[:] = _merged(service, render)
    for part, found in zip(fresh, service.store.get_tiles(render.id, fresh), strict=True):
        tile = part.tile
        image[tile.y0 : tile.y1, tile.x0 : tile.x1] = found
    return image


def visible_events(events: Sequence[TileEvent]) -> list[TileEvent]:
    """Leave out the events of tiles over which a later one of the whole picture is painted."""
    whole = [place for place, event in enumerate(events) if event.tile == WHOLE]
    return list(events[whole[-1] :] if whole else events)


def target_pixels(
    service: Service, render: RenderRow, events: Sequence[TileEvent], fresh: Sequence[StoredTile]
) -> list[tuple[TileEvent, Pixels]]:
    """Return the visible events of a render of target quality, each with its pixels as they are now.

    Parameters
    ----------
    fresh
        The finished tiles of the pass that is not merged yet.
    """
    shown = visible_events(events)
    wanted = {event.tile for event in shown if event.pass_index == len(render.merges)}
    parts = [part for part in fresh if part.tile.index in wanted]
    tiles = service.store.get_tiles(render.id, parts)
    newest = {part.tile.index: found for part, found in zip(parts, tiles, strict=True)}
    return [
        (
            event,
            newest[event.tile]
            if event.pass_index == len(render.merges)
            else _merged(service, render)[event.y0 : event.y1, event.x0 : event.x1],
        )
        for event in shown
    ]


def _merged(service: Service, render: RenderRow) -> Pixels:
    merged = len(render.merges) - 1, targets.merged_by(render)
    return service.store.get_map(render.id, *merged, "picture")
