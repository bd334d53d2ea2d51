"""Run migrations, with Alembic."""

from __future__ import annotations

import logging
import math
import re
import sqlite3
import time
from datetime import timedelta
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, func, inspect, select

from service.errors import DatabaseVersionError
from service.storage.database.connection import PRIMARY_CODE, Database
from service.storage.database.models import LeaderRow

# Between two statements a migration may think longer than a transaction of the service.
SILENCE_MS = 60_000
# How often to look whether services of an earlier version are gone.
LOOK_SECONDS = 0.5
# After the end of a lease another server tries to lead within half a second, if there is one.
SUCCESSION_TIME = timedelta(seconds=2)
IN_USE = (
    "A service of an earlier version, or another program, uses this database. Two versions cannot use it at "
    "the same time: stop all servers and workers of the earlier one, then start this one."
)
# Before the first release migrations were numbered 0001 to 0017.
_UNRELEASED = re.compile(r"00\d\d")

# Commands that no service configures the log for have their results on stdout; this goes to stderr.
log = logging.getLogger(__name__)


def run(database: Database, scripts: Path, wait_seconds: float) -> None:
    """Run the migrations in a folder that the database has not had yet; `upgrade` says more."""
    deadline, waits = time.monotonic() + wait_seconds, False
    while not _run_alone(database, scripts):
        if not waits:
            log.warning("A service of an earlier version uses this database. Waiting for its end.")
        elif time.monotonic() > deadline:
            raise DatabaseVersionError(IN_USE)
        waits = True
        time.sleep(LOOK_SECONDS)


def _run_alone(database: Database, scripts: Path) -> bool:
    """Run the migrations in one transaction; False, and nothing done, while a service may use the tables."""
    with database.engine.connect() as connection:
        if check_version(connection, scripts):
            # Another server of this version was faster.
            return True
    if not database.shared and _is_open_elsewhere(database):
        return False
    config = Config()
    config.set_main_option("script_location", str(scripts))
    connectable = database.engine.execution_options(
        writes=True, silence_ms=SILENCE_MS, answer_seconds=math.inf
    )
    with connectable.begin() as connection:
        if not check_version(connection, scripts) and database.shared and _is_led(connection):
            return False
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
    return True


def _is_led(connection: Connection) -> bool:
    """Whether a server leads on a database, or may begin to in a moment: its tables are not to be changed."""
    if not inspect(connection).has_table(LeaderRow.__tablename__):
        return False
    expires_at, now = connection.execute(select(LeaderRow.expires_at, func.clock_timestamp())).one()
    return bool(now < expires_at + SUCCESSION_TIME)


def _is_open_elsewhere(database: Database) -> bool:
    """Whether another program has an SQLite database open: changing its journal needs exclusive access."""
    database.engine.dispose()
    connection = database.engine.raw_connection()
    try:
        cursor = connection.cursor()
        cursor.execute("PRAGMA busy_timeout = 0")
        cursor.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.OperationalError as error:
        return error.sqlite_errorcode & PRIMARY_CODE == sqlite3.SQLITE_BUSY
    finally:
        connection.invalidate()
    return False


def check_version(connection: Connection, scripts: Path) -> bool:
    """Return whether all migrations were run; raise DatabaseVersionError if they cannot be."""
    directory = ScriptDirectory(str(scripts))
    known = {script.revision for script in directory.walk_revisions()}
    found = MigrationContext.configure(connection).get_current_revision()
    if found is None or found in known:
        return found == directory.get_current_head()
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
