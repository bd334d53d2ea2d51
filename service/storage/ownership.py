"""Ownership of stored pictures: by one database, and by one service or several that share it."""

from __future__ import annotations

import fcntl
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import select

from schemas.api.jobs import JobState
from service.errors import StoreTakenError
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow, RenderRow
from service.storage.folder import JOBS
from service.storage.objects import Objects

MARK_FILE = "database-id"
"""File that names the database to which a place belongs."""
CLAIMED = "?"
"""Prefix of the name in the database until the place is marked, too."""

_TAKEN = "{} is for the pictures of another database. Name an empty place for a new one."


@contextmanager
def held(folder: Path, *, shared: bool) -> Iterator[None]:
    """Make a folder, and keep other services off it until the block ends or the process dies.

    Parameters
    ----------
    folder : Path
        The data folder.
    shared : bool
        Whether other services that share it may use it at the same time.

    Raises
    ------
    StoreTakenError
        If another service uses it.
    OSError
        If it cannot be made or written.
    """
    # It has everybody's scenes and pictures, so no other user of the machine may read it.
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            message = (
                f"Another service uses {folder}. Stop it, or name another folder; "
                "only services on PostgreSQL can share one."
            )
            raise StoreTakenError(message) from None
        yield


def check(database: Database, place: Objects) -> None:
    """Check that a place belongs to a database; a new database takes an empty one.

    A server with the wrong place, perhaps because a disk is not mounted, would delete unknown files as
    orphans, and write files where others do not find them.

    Raises
    ------
    StoreTakenError
        If they do not belong together.
    StoreAwayError
        If the place cannot be reached.
    """
    with database.starting():
        folder = _folder(database)
        if folder is None or folder.startswith(CLAIMED):
            _claim(database, place, folder)
        elif _mark(place) != folder:
            raise StoreTakenError(
                f"{place.place} is not where the pictures of this database are. Is a disk not mounted, or a "
                f"bucket another one? Name the place in which {MARK_FILE} holds {folder}."
            )


def _claim(database: Database, place: Objects, claimed: str | None) -> None:
    """Mark a place with the name that the database has for it, or a new one.

    Nothing is written to the place under the write lock, which others would wait for. The database has the
    name first, so that after a crash the place is known by it.

    Parameters
    ----------
    claimed
        The token that an unfinished start left in the database.
    """
    mark = _mark(place)
    if mark is None:
        _check_pictures(database, place)
    elif claimed is None or mark != claimed.removeprefix(CLAIMED):
        raise StoreTakenError(_TAKEN.format(place.place))
    name = claimed.removeprefix(CLAIMED) if claimed else secrets.token_hex(8)
    if claimed is None:
        _record(database, f"{CLAIMED}{name}")
    if mark is None:
        place.put(MARK_FILE, f"{name}\n".encode(), durable=True)
    _record(database, name)


def _folder(database: Database) -> str | None:
    with database.reading() as session:
        return session.scalars(select(LeaderRow.folder)).one()


def _record(database: Database, folder: str) -> None:
    with database.writing() as session:
        session.scalars(select(LeaderRow)).one().folder = folder


def _mark(place: Objects) -> str | None:
    return place.get(MARK_FILE).decode().strip() if place.find(MARK_FILE) else None


def _check_pictures(database: Database, place: Objects) -> None:
    """Check that an unmarked place has the pictures of this database, and no others."""
    with database.reading() as session:
        newest = select(RenderRow).where(RenderRow.state == JobState.SUCCEEDED)
        render = session.scalar(newest.order_by(RenderRow.number.desc()).limit(1))
    if render is None and any(place.found(JOBS)):
        raise StoreTakenError(_TAKEN.format(place.place))
    if render is not None and place.find(f"{JOBS}/{render.id}/{render.final_prefix}image.npy") is None:
        raise StoreTakenError(
            f"The pictures of this database are not in {place.place}. Copy what is in the folders jobs and "
            "assets of its data folder there first."
        )
