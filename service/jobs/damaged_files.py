"""Damaged or missing files of pictures, and their consequences.

A damaged file of a final picture marks the picture: its jobs report it, and it is never shared. Encodings are
made again, and lost tiles of an unfinished picture are rendered again.
"""

from __future__ import annotations

import errno
from dataclasses import replace
from functools import partial

import structlog
from sqlalchemy.exc import SQLAlchemyError

from service.dispatch import adaptive_passes as adaptive
from service.dispatch import ledger
from service.errors import PictureDamagedError, StoreDamagedError
from service.jobs.bands import Finished
from service.jobs.context import Service
from service.lifecycle import rows
from service.storage.checking import checked
from service.storage.checksums import LOSS_ERRORS, is_lost
from service.storage.database.models import RenderRow
from service.storage.objects import Stored
from service.storage.tiles import TileStore, damaged_steps
from service.workers import layers
from service.workers.tasks import InputDamaged

IMAGE = "image.npy"

log = structlog.get_logger()


def find(service: Service, render: RenderRow, file: str) -> Stored | None:
    """Find a file of a final picture by its name without the prefix of its attempt.

    Returns
    -------
    Stored or None
        Its reads are checked, and those that fail raise an error as `lost` does. None if it is an encoding
        that must be made first.

    Raises
    ------
    PictureDamagedError
        If it is not an encoding, and missing or of another size than was written.
    """
    name = f"{render.final_prefix}{file}"
    stored, known = service.store.find(render.id, name), rows.expected(render, name)
    if is_encoding(file) and render.checksums is not None and known is None:
        return None
    try:
        if stored is None:
            raise StoreDamagedError(name)
        found = checked(name, stored, known)
    except StoreDamagedError:
        if is_encoding(file):
            return None
        raise lost(service, render, file) from None
    return replace(found, read=partial(_read, service, render, file, found))


def is_encoding(file: str) -> bool:
    """Whether a file of a final picture is made of the others."""
    return not file.endswith(".npy")


def _read(service: Service, render: RenderRow, file: str, stored: Stored, begin: int, end: int) -> bytes:
    try:
        return stored.read(begin, end)
    except LOSS_ERRORS as error:
        raise lost(service, render, file) from error


def lost(service: Service, render: RenderRow, file: str) -> Exception:
    """Record that a file of a final picture is damaged or missing, and return the error to raise.

    It is FileNotFoundError for an encoding, which the next request makes again, and where the picture was
    deleted meanwhile.
    """
    if is_encoding(file):
        log.error("stored file damaged", render=render.id, file=file)
        service.store.objects.delete([f"{render.id}/{render.final_prefix}{file}"])
        return FileNotFoundError(errno.ENOENT, "The encoding is damaged", file)
    try:
        with service.database.writing() as session:
            row = session.get(RenderRow, render.number)
            if row is None:
                return FileNotFoundError(errno.ENOENT, "The picture was deleted", file)
            if row.damage is None:
                log.error("stored file damaged", render=render.id, file=file)
                # Without a version it is never shared again.
                row.version, row.damage = None, file
    except SQLAlchemyError as error:
        log.warning("damage not recorded", render=render.id, error=type(error).__name__)
    return PictureDamagedError(file)


def note_loss(service: Service, finished: Finished, error: Exception) -> None:
    """Handle the loss of a file of a picture, so that it can be read again.

    Parameters
    ----------
    error
        The error of reading the picture.

    Raises
    ------
    PictureDamagedError
        If it is final.
    """
    render = finished.render
    if render.image_sha256 is None:
        _repair(service, finished)
        return
    name = str(error.name if isinstance(error, StoreDamagedError) else getattr(error, "filename", ""))
    file = name.rpartition("/")[2].removeprefix(render.final_prefix)
    raise lost(service, render, file if file in _files(render) else IMAGE) from error


def has_files(service: Service, render: RenderRow) -> bool:
    """Whether all files of a final picture are there, by their sizes; one that has not is marked."""
    try:
        return all(find(service, render, file) for file in _files(render))
    except (FileNotFoundError, PictureDamagedError):
        return False


def _files(render: RenderRow) -> list[str]:
    return [IMAGE, *map(layers.file_name, render.layers)]


def _read_merged(store: TileStore, render: RenderRow) -> None:
    newest = len(render.merges) - 1, adaptive.merged_by(render)
    store.get_map(render.id, *newest, "picture", rows.checksums_of(render))


def _repair(service: Service, finished: Finished) -> None:
    """Have lost tiles of an unfinished picture rendered again, unless its job has ended meanwhile."""
    store, render = service.store, finished.render
    with service.database.reading() as session:
        row = session.get(RenderRow, render.number)
    if row is None or row.state.final:
        return
    parts = finished.parts if finished.coarse is None else (finished.coarse, *finished.parts)
    steps = damaged_steps(parts, partial(store.get_tile, render.id))
    steps += layers.damaged(store, render.id, render.layers, finished.recorded)
    merged = bool(render.merges) and is_lost(partial(_read_merged, store, render))
    damaged = InputDamaged(tuple(steps), merged)
    log.error("stored files damaged", render=render.id, steps=steps, merged=merged)
    with service.database.writing() as session:
        row = ledger.render_of(session, render.id)
        # Where another pass is merged meanwhile, the files of those before it have gone.
        if row is not None and not row.state.final and len(row.merges) == len(render.merges):
            ledger.repair(session, row, damaged, service.settings.max_attempts)
        service.database.notify(session, work=True)
    service.dispatcher.wake()
