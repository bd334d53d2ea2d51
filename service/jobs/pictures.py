"""The picture of a job and its layers.

Final ones come from their files; before that they are composed of the finished tiles.
"""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Literal, TypeVar

import numpy as np
import structlog
from anyio import from_thread
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from renderer.images import files as image_files
from renderer.layers import LAYERS
from schemas.api.jobs import JobState, TileEvent
from schemas.scene import Display
from schemas.tiles import Tile
from service.dispatch import adaptive_passes as adaptive
from service.dispatch import ledger
from service.errors import (
    PictureGoneError,
    PictureNotReadyError,
    StoreAwayError,
    StoreFullError,
    StoreReadOnlyError,
    UnknownJobError,
    UnknownLayerError,
)
from service.jobs import damaged_files
from service.jobs.bands import Finished
from service.jobs.context import Service
from service.jobs.lifecycle import find
from service.lifecycle import progress, rows, totals
from service.lifecycle.documents import work_of
from service.storage.checksums import LOSS_ERRORS, Checksum, checksum_of_file
from service.storage.database.models import JobRow, RenderRow
from service.storage.folder import stored_file, translate_errors
from service.storage.objects import Stored
from service.storage.tiles import Pixels, StoredTile, TileStore
from service.workers import layers
from service.workers.tasks import WHOLE_PICTURE

Part = TypeVar("Part")
Kind = Literal["png", "npy", "exr"]
log = structlog.get_logger()

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

    content: Stored
    etag: str
    share: float


@dataclass(frozen=True)
class Look:
    """Metadata of a picture before it is encoded.

    Attributes
    ----------
    etag : str or None
        The tag that it would have now; None if nothing is finished.
    encoded : Picture or None
        The picture, if its file is there.
    pixels : int
        Number of pixels to encode.
    """

    etag: str | None
    encoded: Picture | None
    pixels: int


def look(service: Service, job_id: str, requested: ImageRequest) -> Look:
    """Return the metadata of a picture without encoding it."""
    with service.database.reading() as session:
        row = _find(session, job_id, requested)
    render = row.render
    if render is None or not (render.image_sha256 or render.last_seq):
        return Look(None, None, 0)
    etag, found = _etag(job_id, render, requested), None
    if render.image_sha256:
        found = damaged_files.find(service, render, requested.name)
    return Look(etag, Picture(found, etag, 1.0) if found else None, render.width * render.height)


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
    FileNotFoundError
        If the job has ended or was deleted meanwhile, or files of it were lost: look again.
    """
    with service.database.reading() as session:
        finished = finished_of(session, _find(session, job_id, requested))
    try:
        return _encoded(service, finished, requested)
    except LOSS_ERRORS as error:
        damaged_files.note_loss(service, finished, error)
        raise FileNotFoundError from error


def _encoded(service: Service, finished: Finished, requested: ImageRequest) -> Picture:
    job, render = finished.job, finished.render
    etag = _etag(job, render, requested)
    if render.image_sha256 is not None:
        return Picture(_final(service, finished, requested), etag, 1.0)
    share = _layer_share(finished, requested.layer) if requested.layer else progress.share(render)
    content = service.unfinished.get(etag)
    if content is None:
        content = _temporary(service, finished, requested)
        service.unfinished.keep(etag, content)
    return Picture(content, etag, share)


def _find(session: Session, job_id: str, requested: ImageRequest) -> JobRow:
    row = find(session, job_id)
    names = work_of(row)["layers"]
    if requested.layer and requested.layer not in names:
        asked = ", ".join(names) or "none"
        raise UnknownLayerError(f"This job has no such layer. The requested layers are: {asked}.")
    return row


def finished_of(session: Session, row: JobRow) -> Finished:
    """Return the finished part of a picture; PictureNotReadyError or PictureGoneError if there is none."""
    render = row.render
    if render is None or row.state in (JobState.FAILED, JobState.CANCELLED):
        raise PictureGoneError(f"There is no picture. The job ended as {row.state.value}.")
    if render.image_sha256 is not None:
        return Finished(row.id, render)
    if render.last_seq == 0:
        raise PictureNotReadyError("No part of the picture is finished yet. Try again in a moment.")
    if render.target_error is not None:
        fresh, recorded = adaptive.fresh(session, render), adaptive.recorded(session, render)
        return Finished(row.id, render, None, tuple(fresh), tuple(recorded))
    parts = tuple(ledger.sampled(session, render))
    return Finished(row.id, render, ledger.coarse(session, render), parts, parts)


def _etag(job: str, render: RenderRow, requested: ImageRequest) -> str:
    # A render has the name of a job, which may belong to another user.
    return f'"{render.image_sha256 or f"{job}-{render.last_seq}"}-{requested.name}"'


def _final(service: Service, finished: Finished, requested: ImageRequest) -> Stored:
    """Find a final picture in the store, or encode it and keep it there."""
    store = service.store
    found = damaged_files.find(service, finished.render, requested.name)
    if found is not None:
        return found
    name = f"{finished.render.final_prefix}{requested.name}"
    path = f"{finished.render.id}/{name}"
    try:
        with store.objects.draft(path) as draft:
            _write(draft, store, finished, requested)
            with Path(draft.name).open("rb") as written:
                checksum = checksum_of_file(written)
            store.objects.keep(draft, path)
        found = store.objects.find(path)
        _enter(service, finished.render, requested.name, checksum)
    except (StoreFullError, StoreReadOnlyError, StoreAwayError):
        # The next request encodes it again.
        log.warning("encoded picture not stored", render=finished.render.id, name=requested.name)
    return found or _temporary(service, finished, requested)


def _enter(service: Service, encoded: RenderRow, file: str, checksum: Checksum) -> None:
    """Record an encoding; its bytes count once, even if several requests have made it concurrently."""
    try:
        with service.database.writing() as session:
            render = session.get(RenderRow, encoded.number)
            if render is None:
                raise UnknownJobError
            if render.checksums is not None:
                documents = rows.documents_of({f"{render.final_prefix}{file}": checksum})
                render.checksums = render.checksums | documents
            if file not in render.encodings:
                render.encodings = [*render.encodings, file]
                if render.stored_bytes is not None:
                    render.stored_bytes += checksum.size
                    totals.add(session, totals.STORED_BYTES, checksum.size)
    except UnknownJobError:
        # Deleted meanwhile: the file would be left behind.
        service.store.drop_job(encoded.id)
    except SQLAlchemyError as error:
        log.warning("encoding not recorded", render=encoded.id, error=type(error).__name__)


def unnamed(folder: Path, write: Callable[[IO[bytes]], None]) -> Stored:
    """Write to a temporary file that exists as long as it is sent.

    Parameters
    ----------
    folder
        Used if the system has no folder for temporary files; otherwise a full disk of the service has no
        effect.
    """
    with translate_errors(), _file_without_name(folder) as file:
        write(file)
        file.flush()
        return replace(stored_file(os.dup(file.fileno())), modified=None)


def _file_without_name(folder: Path) -> AbstractContextManager[IO[bytes]]:
    try:
        return tempfile.NamedTemporaryFile()
    except OSError:
        return tempfile.NamedTemporaryFile(dir=folder)


def wanted(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield parts of a picture as long as the client that it is made for is connected."""
    for part in parts:
        from_thread.check_cancelled()
        yield part


def _temporary(service: Service, finished: Finished, requested: ImageRequest) -> Stored:
    """Encode a picture to a file that is there as long as it is sent."""
    return unnamed(service.settings.data, lambda file: _write(file, service.store, finished, requested))


def _write(file: IO[bytes], store: TileStore, finished: Finished, requested: ImageRequest) -> None:
    """Encode a picture band by band."""
    render = finished.render
    size = render.height, render.width
    if requested.layer:
        layer, sheets = LAYERS[requested.layer], wanted(finished.layer(store, requested.layer))
        shape = layer.blank(*size).shape
        image_files.write_npy(file, shape, layer.dtype, (sheet[layer.name] for sheet in sheets))
    elif requested.kind == "exr":
        _write_exr(file.name, size, wanted(finished.bands(store, render.layers)), render.layers)
    else:
        pixels = (pixels for pixels, _ in wanted(finished.bands(store, ())))
        if requested.kind == "npy":
            image_files.write_npy(file, (*size, 3), np.float32, pixels)
        else:
            display = Display.model_validate(render.display)
            image_files.write_png(file, size, pixels, display, requested.width)
    file.flush()


def _write_exr(name: str, *content: Any) -> None:
    try:
        image_files.write_exr(name, *content)
    except OSError as error:
        # Its library gives the reason in the system's words, without the number.
        reason = next((number for number in errno.errorcode if os.strerror(number) in str(error)), None)
        if error.errno is not None or reason is None:
            raise
        raise OSError(reason, str(error)) from error


def _layer_share(finished: Finished, name: str) -> float:
    """Return the finished share of a layer, above 0 to 1; PictureNotReadyError if it is 0."""
    render, parts = finished.render, layers.recorded(finished.recorded, (name,))
    if render.target_error is not None and not layers.of_centres(name):
        raise PictureNotReadyError("With target quality this layer is there when the picture is finished.")
    if not parts:
        raise PictureNotReadyError("No part of the layer is finished yet. Try again in a moment.")
    passes = [pass_ for pass_ in rows.passes_of(render) if layers.records(pass_, (name,))]
    total = sum(rows.work(pass_, Tile(0, 0, 0, render.width, render.height)) for pass_ in passes)
    return sum(rows.work(part.pass_, part.tile) for part in parts) / total


def visible_events(events: Sequence[TileEvent]) -> list[TileEvent]:
    """Leave out the events of tiles over which a later one of the whole picture is painted."""
    whole = [place for place, event in enumerate(events) if event.tile == WHOLE_PICTURE]
    return list(events[whole[-1] :] if whole else events)


def target_pixels(
    service: Service, render: RenderRow, events: Sequence[TileEvent], fresh: Sequence[StoredTile]
) -> Iterator[tuple[TileEvent, Pixels]]:
    """Yield the visible events of a render of target quality, each with its pixels as they are now.

    Parameters
    ----------
    fresh
        The finished tiles of the pass that is not merged yet.
    """
    shown = visible_events(events)
    part_of = {part.tile.index: part for part in fresh}
    is_fresh = [event.pass_index == len(render.merges) for event in shown]
    parts = [part_of[event.tile] for event, new in zip(shown, is_fresh, strict=True) if new]
    tiles = service.store.get_tiles(render.id, parts)
    merged = None if all(is_fresh) else _merged(service, render)
    for event, new in zip(shown, is_fresh, strict=True):
        if new:
            yield event, next(tiles)
        elif merged is not None:
            yield event, merged[event.y0 : event.y1, event.x0 : event.x1]


def _merged(service: Service, render: RenderRow) -> Pixels:
    merged = len(render.merges) - 1, adaptive.merged_by(render)
    return service.store.get_map(render.id, *merged, "picture", rows.checksums_of(render))
