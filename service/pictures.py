"""The picture of a job and its layers.

Final they come from their files, before that they are put together from the tiles finished so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Literal

import numpy as np
from sqlalchemy.orm import Session

from renderer import film, image_files
from schemas.display import Display
from schemas.jobs import JobState
from schemas.tiles import Tile
from service import layers, ledger, rows, target_pictures, targets
from service.context import Service
from service.database.models import JobRow
from service.errors import PictureGoneError, PictureNotReadyError, UnknownLayerError
from service.jobs import find
from service.store.tiles import Layers, Pixels, StoredTile, TileStore

Kind = Literal["png", "npy", "exr"]
MEDIA_TYPES: dict[Kind, str] = {"png": "image/png", "npy": "application/octet-stream", "exr": "image/x-exr"}


@dataclass(frozen=True)
class Wanted:
    """Which file of a job is asked for: its picture in some form, or one of its layers."""

    kind: Kind
    layer: str | None = None

    @property
    def name(self) -> str:
        """Name of the file in the store once it is final."""
        return layers.file_name(self.layer) if self.layer else f"image.{self.kind}"


@dataclass(frozen=True)
class Picture:
    """A picture ready to be sent.

    ``content`` is a file once the picture is final. ``etag`` changes with every byte; ``share`` of the
    samples are in it, 0 to 1.
    """

    content: bytes | Path
    etag: str
    share: float


@dataclass(frozen=True)
class _Finished:
    """What was finished when the database was read."""

    row: JobRow
    coarse: StoredTile | None
    parts: tuple[StoredTile, ...]
    recorded: tuple[StoredTile, ...]
    """The finished steps that may have recorded layers."""


def etag_of(service: Service, job_id: str, wanted: Wanted) -> str | None:
    """Return the tag that the file would have now, without making it."""
    with service.database.reading() as session:
        row = _find(session, job_id, wanted)
        return _etag(row, wanted) if row.image_sha256 or row.last_seq else None


def picture(service: Service, job_id: str, wanted: Wanted) -> Picture:
    """Give the picture of a job, or one of its layers, as it is now.

    Raises
    ------
    UnknownLayerError
        If the job was not asked for this layer.
    PictureNotReadyError
        If nothing is finished yet.
    PictureGoneError
        If the job failed or was cancelled.
    """
    try:
        return _picture(service, job_id, wanted)
    except FileNotFoundError:
        # The job ended in between, and its tiles went into the final picture or away.
        return _picture(service, job_id, wanted)


def _picture(service: Service, job_id: str, wanted: Wanted) -> Picture:
    with service.database.reading() as session:
        finished = _finished(session, _find(session, job_id, wanted))
    row = finished.row
    if row.image_sha256 is not None:
        return Picture(_final(service.store, row, wanted), _etag(row, wanted), 1.0)
    if wanted.layer:
        return _layer_so_far(service.store, finished, wanted, wanted.layer)
    pixels = _so_far(service, finished)
    sheets = _layers_so_far(service.store, finished, row.layers if wanted.kind == "exr" else ())
    return Picture(_encode(pixels, sheets, row, wanted), _etag(row, wanted), rows.share(row))


def _find(session: Session, job_id: str, wanted: Wanted) -> JobRow:
    row = find(session, job_id)
    if wanted.layer and wanted.layer not in row.layers:
        asked = ", ".join(row.layers) or "none"
        raise UnknownLayerError(f"There is no such layer of this job. The layers asked for are: {asked}.")
    return row


def _finished(session: Session, row: JobRow) -> _Finished:
    if row.state in (JobState.FAILED, JobState.CANCELLED):
        raise PictureGoneError(f"There is no picture. The job ended as {row.state.value}.")
    if row.image_sha256 is not None:
        return _Finished(row, None, (), ())
    if row.last_seq == 0:
        raise PictureNotReadyError("Nothing of the picture is finished yet. Ask again in a moment.")
    if row.target_error is not None:
        return _Finished(row, None, tuple(targets.fresh(session, row)), tuple(targets.recorded(session, row)))
    parts = tuple(ledger.sampled(session, row))
    return _Finished(row, ledger.coarse(session, row), parts, parts)


def _etag(row: JobRow, wanted: Wanted) -> str:
    return f'"{row.image_sha256 or f"{row.id}-{row.last_seq}"}-{wanted.name}"'


def _final(store: TileStore, row: JobRow, wanted: Wanted) -> Path:
    path = store.file(row.id, wanted.name)
    if path.exists():
        return path
    pixels = np.load(store.file(row.id, "image.npy"))
    names = row.layers if wanted.kind == "exr" else ()
    sheets = {name: np.load(store.file(row.id, layers.file_name(name))) for name in names}
    return store.put_file(row.id, wanted.name, _encode(pixels, sheets, row, wanted))


def _encode(pixels: Pixels, sheets: Layers, row: JobRow, wanted: Wanted) -> bytes:
    display = Display.model_validate(row.display)
    return image_files.encode(f".{wanted.kind}", pixels, display, sheets)


def _layer_so_far(store: TileStore, finished: _Finished, wanted: Wanted, name: str) -> Picture:
    row, parts = finished.row, layers.recorded(finished.recorded, (name,))
    if row.target_error is not None and not layers.of_centres(name):
        raise PictureNotReadyError("With target quality this layer is there when the picture is finished.")
    if not parts:
        raise PictureNotReadyError("Nothing of the layer is finished yet. Ask again in a moment.")
    sheet = _layers_so_far(store, finished, (name,))[name]
    passes = [pass_ for pass_ in rows.passes_of(row) if layers.records(pass_, (name,))]
    total = sum(rows.work(pass_, Tile(0, 0, 0, row.width, row.height)) for pass_ in passes)
    share = sum(rows.work(part.pass_, part.tile) for part in parts) / total
    return Picture(image_files.encode_layer(sheet), _etag(row, wanted), share)


def _layers_so_far(store: TileStore, finished: _Finished, names: Sequence[str]) -> Layers:
    row = finished.row
    return layers.composed(store, row.id, (row.height, row.width), names, finished.recorded)


def _so_far(service: Service, finished: _Finished) -> Pixels:
    row, store = finished.row, service.store
    if row.target_error is not None:
        return target_pictures.so_far(service, row, finished.parts)
    image = np.zeros((row.height, row.width, 3), np.float32)
    if finished.coarse is not None:
        stride = finished.coarse.pass_.stride
        image[:] = film.enlarge(store.get_tile(row.id, finished.coarse), stride, row.height, row.width)
    for _, group in groupby(finished.parts, key=lambda part: part.tile.index):
        parts = list(group)
        tile = parts[0].tile
        image[tile.y0 : tile.y1, tile.x0 : tile.x1] = mean_of(store, row.id, parts)
    return image


def mean_of(store: TileStore, job_id: str, parts: list[StoredTile]) -> Pixels:
    """Return the mean of all samples in the finished passes of one tile, given in their order."""
    return film.compose([(part.pass_, store.get_tile(job_id, part)) for part in parts])
