"""Bring a database to the tables of this version, from any earlier one."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config

from service.database.connection import Database


def upgrade(database: Database) -> None:
    """Run the migrations that the database has not had yet.

    Raises
    ------
    alembic.util.CommandError
        If a later version of the service has used this database.
    """
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent))
    with database.engine.execution_options(writes=True).begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
