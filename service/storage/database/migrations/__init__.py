"""Bring a database to the tables of this version, from any earlier one."""

from __future__ import annotations

import math
from pathlib import Path

from alembic import command
from alembic.config import Config

from service.storage.database.connection import Database

# Between two statements a migration may think longer than a transaction of the service.
SILENCE_MS = 60_000


def upgrade(database: Database) -> None:
    """Run the migrations that the database has not had yet.

    Raises
    ------
    alembic.util.CommandError
        If a later version of the service has used this database.
    """
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent))
    patient = database.engine.execution_options(writes=True, silence_ms=SILENCE_MS, answer_seconds=math.inf)
    with patient.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
