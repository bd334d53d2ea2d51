"""Bring a database to the tables of this version, from those of any release.

A change of ``models.py`` needs a migration: the next is ``tables_0006.py``, with ``tables_0005`` as
its ``down_revision``. On SQLite a table that others refer to cannot be rebuilt in place: dropping it deletes
the rows that refer to it. Copy those first. Nothing leads back but a backup.
"""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Connection, inspect, text

from service.storage.database.connection import Database

SCRIPTS = Path(__file__).parent
WAIT_SECONDS = 30.0
"""Seconds that servers of an earlier version may take to stop: those of a cluster have 20."""


def upgrade(database: Database, scripts: Path = SCRIPTS, wait_seconds: float = WAIT_SECONDS) -> None:
    """Run the migrations that the database has not had yet: all of them, or none where one fails.

    Parameters
    ----------
    scripts
        The folder of ``env.py`` and ``versions``.
    wait_seconds
        How long to wait for the end of services that use the database with its earlier tables: they would
        write rows in which the later ones lack something.

    Raises
    ------
    DatabaseVersionError
        If another version of the service has made its tables and there is no way from them to these, or
        still uses them after the wait.
    """
    with database.engine.connect() as connection:
        if is_current(connection, scripts):
            return
    from service.storage.database.migrations import running  # noqa: PLC0415  (few starts need it, and it is slow)

    running.run(database, scripts, wait_seconds)


def is_current(connection: Connection, scripts: Path) -> bool:
    """Whether the last migration, which has the name of its file, has been run."""
    if not inspect(connection).has_table("alembic_version"):
        return False
    last = max(path.stem for path in scripts.glob("versions/tables_*.py"))
    return connection.scalars(text("SELECT version_num FROM alembic_version")).all() == [last]
