"""The data folder of a service of version 0.1.0, as it was when that was killed while it rendered."""

import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx2
from alembic import command
from alembic.config import Config
from sqlalchemy import Connection, create_engine, func, select

from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import SCRIPTS
from service.storage.database.migrations.versions.tables_0001 import METADATA
from tests.service.forking import running
from tests.service.support import TIMEOUT

ARCHIVE = Path(__file__).with_name("releases") / "0.1.0.tar.xz"
FIRST = "tables_0001"
FILE = "penumbra.sqlite"
ENDED = {
    "expired": "expired",
    "fixed": "succeeded",
    "random": "succeeded",
    "layers": "succeeded",
    "target": "succeeded",
    "shared": "succeeded",
    "sharing": "succeeded",
    "cancelled": "cancelled",
    "failed": "failed",
}
"""The jobs that had ended, and how, by their label ``name``."""
OPEN = ("paused", "merged", "handed_out", "queued", "queued_target")
"""Jobs that had not ended: paused, between two passes, with tiles at workers, and not begun."""


def unpack(folder: Path) -> Path:
    """Unpack the data folder."""
    with tarfile.open(ARCHIVE) as archive:
        # Python 3.11 before 3.11.4, as in Debian 12, knows no filters.
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(folder)  # noqa: S202  our own
    return folder


def copied(data: Path, url: str) -> None:
    """Give another database the tables of the first release, and the rows of a data folder."""
    database = Database(url)
    with database.engine.execution_options(writes=True).begin() as connection:
        make_first(connection)
        with create_engine(f"sqlite:///{data / FILE}").connect() as source:
            _copy(source, connection)
    database.close()


def make_first(connection: Connection) -> None:
    """Make the tables of the first release."""
    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    config.attributes["connection"] = connection
    command.upgrade(config, FIRST)


def _copy(source: Connection, target: Connection) -> None:
    for table in METADATA.sorted_tables:
        target.execute(table.delete())
        rows = [_zoned(row) for row in source.execute(select(table)).mappings()]
        if rows:
            target.execute(table.insert(), rows)
    for table in ("jobs", "renders"):
        newest = select(func.max(METADATA.tables[table].c.number)).scalar_subquery()
        target.execute(select(func.setval(func.pg_get_serial_sequence(table, "number"), newest)))


def _zoned(row: Any) -> dict[str, Any]:
    """Times with their zone, which SQLite does not store."""
    return {
        name: value.replace(tzinfo=UTC) if isinstance(value, datetime) else value
        for name, value in row.items()
    }


@contextmanager
def serving(data: Path, url: str) -> Iterator[httpx2.Client]:
    """Open a data folder with this version. Its pictures are older than any that a service keeps."""
    settings = Settings(data=data, database=url, port=0, workers=1, log_level="error", keep_seconds=1e9)
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        yield client


def listed(client: httpx2.Client) -> dict[str, dict[str, Any]]:
    """All jobs, by their label ``name``; damaged ones by the name of their scene, which is the same."""
    answer = client.get("/v1/jobs", params={"limit": 100})
    assert answer.status_code == 200, answer.text
    return {job["labels"].get("name", job["name"]): job for job in answer.json()["jobs"]}
