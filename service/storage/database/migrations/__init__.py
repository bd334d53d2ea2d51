"""Bring a database to the tables of this version, from those of any release.

A change of ``models.py`` needs a migration: the next is ``tables_0004.py``, with ``tables_0003`` as
its ``down_revision``. On SQLite a table that others refer to cannot be rebuilt in place: dropping it deletes
the rows that refer to it. Copy those first. Nothing leads back but a backup.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

from service.errors import DatabaseVersionError
from service.storage.database.connection import Database

SCRIPTS = Path(__file__).parent
# Between two statements a migration may think longer than a transaction of the service.
SILENCE_MS = 60_000
# Before the first release migrations were numbered 0001 to 0017.
_UNRELEASED = re.compile(r"00\d\d")


def upgrade(database: Database, scripts: Path = SCRIPTS) -> None:
    """Run the migrations that the database has not had yet: all of them, or none where one fails.

    Parameters
    ----------
    scripts
        The folder of ``env.py`` and ``versions``.

    Raises
    ------
    DatabaseVersionError
        If another version of the service has made its tables, and there is no way from them to these.
    """
    config = Config()
    config.set_main_option("script_location", str(scripts))
    connectable = database.engine.execution_options(
        writes=True, silence_ms=SILENCE_MS, answer_seconds=math.inf
    )
    with connectable.begin() as connection:
        _check_version(connection, ScriptDirectory.from_config(config))
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def check_version(connection: Connection) -> None:
    """Raise DatabaseVersionError where `upgrade` would; nothing is changed."""
    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    _check_version(connection, ScriptDirectory.from_config(config))


def _check_version(connection: Connection, scripts: ScriptDirectory) -> None:
    found = MigrationContext.configure(connection).get_current_revision()
    if found is None or found in {script.revision for script in scripts.walk_revisions()}:
        return
    if _UNRELEASED.fullmatch(found):
        raise DatabaseVersionError(
            f"This database has the tables of a version before the first release ({found}), which cannot be "
            "upgraded. Start with an empty data folder, or name an empty database. Pictures that you want to "
            "keep can be fetched with the version that made them."
        )
    raise DatabaseVersionError(
        f"A later version of the service has changed the tables of this database ({found}). Start that "
        "version, or restore a backup from before the upgrade."
    )
