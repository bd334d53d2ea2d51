"""Run migrations, with Alembic."""

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

# Between two statements a migration may think longer than a transaction of the service.
SILENCE_MS = 60_000
# Before the first release migrations were numbered 0001 to 0017.
_UNRELEASED = re.compile(r"00\d\d")


def run(database: Database, scripts: Path) -> None:
    """Run the migrations in a folder that the database has not had yet; `upgrade` says more."""
    config = Config()
    config.set_main_option("script_location", str(scripts))
    connectable = database.engine.execution_options(
        writes=True, silence_ms=SILENCE_MS, answer_seconds=math.inf
    )
    with connectable.begin() as connection:
        check_version(connection, scripts)
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def check_version(connection: Connection, scripts: Path) -> None:
    """Raise DatabaseVersionError where `run` would; nothing is changed."""
    known = {script.revision for script in ScriptDirectory(str(scripts)).walk_revisions()}
    found = MigrationContext.configure(connection).get_current_revision()
    if found is None or found in known:
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
