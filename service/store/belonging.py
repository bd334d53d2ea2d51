"""A database and the data folder that belongs to it know each other."""

from __future__ import annotations

import secrets
from pathlib import Path

from sqlalchemy import select

from service.database.connection import Database
from service.database.models import LeaderRow
from service.errors import StoreTakenError

MARK = "database-id"
"""The file of a data folder that names the database which it belongs to."""


def check(database: Database, folder: Path) -> None:
    """See that a folder is the one of a shared database; a new database takes an empty one.

    A server whose folder is another one, perhaps because a disk is not mounted, would remove files that it
    knows nothing of, and write where nobody looks.

    Raises
    ------
    StoreTakenError
        If they do not belong together.
    """
    mark = folder / MARK
    found = mark.read_text().strip() if mark.exists() else None
    with database.writing() as session:
        row = session.scalars(select(LeaderRow)).one()
        if row.folder is None:
            if any((folder / "jobs").glob("*")):
                raise StoreTakenError(
                    f"{folder} has the pictures of another database. Name an empty folder for a new one."
                )
            row.folder = found or secrets.token_hex(8)
            mark.write_text(f"{row.folder}\n")
        elif found != row.folder:
            raise StoreTakenError(
                f"{folder} is not the data folder of this database. Is a disk not mounted? "
                f"Name the folder in which {MARK} holds {row.folder}."
            )
