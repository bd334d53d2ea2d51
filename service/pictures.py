"""The picture of a job: final from its file, before that put together from the tiles finished so far."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Literal

import numpy as np
from sqlalchemy.orm import Session

from renderer import film, image_files
from schemas.display import Display
from schemas.jobs import JobState
from service import ledger
from service.context import Service
from service.database.models import JobRow
from service.errors import PictureGoneError, PictureNotReadyError
from service.jobs import find
from service.store.tiles import Pixels, StoredTile, TileStore

Kind = Literal["png", "npy"]
MEDIA_TYPES: dict[Kind, str] = {"png": "image/png", "npy": "application/octet-stream"}


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


def etag_of(service: Service, job_id: str, kind: Kind) -> str | None:
    """Return the tag that the picture would have now, without making it."""
    with service.database.reading() as session:
        row = find(session, job_id)
        return _etag(row, kind) if row.image_sha256 or row.last_seq else None


def picture(service: Service, job_id: str, kind: Kind) -> Picture:
    """Give the picture of a job as it is now.

    Raises
    ------
    PictureNotReadyError
        If nothing is finished yet.
    PictureGoneError
        If the job failed or was cancelled.
    """
    try:
        return _picture(service, job_id, kind)
    except FileNotFoundError:
        # The job ended in between, and its tiles went into the final picture or away.
        return _picture(service, job_id, kind)


def _picture(service: Service, job_id: str, kind: Kind) -> Picture:
    with service.database.reading() as session:
        finished = _finished(session, find(session, job_id))
    row = finished.row
    if row.image_sha256 is not None:
        return Picture(_final(service.store, row, kind), _etag(row, kind), 1.0)
    pixels = _so_far(service.store, finished)
    return Picture(_encode(pixels, row, kind), _etag(row, kind), row.done_work / row.total_work)


def _finished(session: Session, row: JobRow) -> _Finished:
    if row.state in (JobState.FAILED, JobState.CANCELLED):
        raise PictureGoneError(f"There is no picture. The job ended as {row.state.value}.")
    if row.image_sha256 is not None:
        return _Finished(row, None, ())
    if row.last_seq == 0:
        raise PictureNotReadyError("Nothing of the picture is finished yet. Ask again in a moment.")
    return _Finished(row, ledger.coarse(session, row), tuple(ledger.sampled(session, row)))


def _etag(row: JobRow, kind: Kind) -> str:
    return f'"{row.image_sha256 or f"{row.id}-{row.last_seq}"}-{kind}"'


def _final(store: TileStore, row: JobRow, kind: Kind) -> Path:
    npy, path = store.file(row.id, "image.npy"), store.file(row.id, f"image.{kind}")
    return path if path.exists() else store.put_file(row.id, path.name, _encode(np.load(npy), row, kind))


def _encode(pixels: Pixels, row: JobRow, kind: Kind) -> bytes:
    if kind == "npy":
        return image_files.encode_npy(pixels)
    return image_files.encode_png(pixels, Display.model_validate(row.display))


def _so_far(store: TileStore, finished: _Finished) -> Pixels:
    row = finished.row
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
