"""Two servers on one database and one data folder."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
from sqlalchemy import select

from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import TileRow
from tests.service.forking import running
from tests.service.support import TIMEOUT, submit, wait, work


@dataclass
class Pair:
    """A server that leads at first, another one, and their database."""

    first: RunningServer
    second: RunningServer
    database: Database

    def leader_and_other(self) -> tuple[RunningServer, RunningServer]:
        return (self.first, self.second) if leads(self.first) else (self.second, self.first)

    def steps(self) -> list[tuple[Any, ...]]:
        """All steps, with who has them or has finished them."""
        with self.database.reading() as session:
            place = TileRow.render, TileRow.pass_index, TileRow.tile
            query = select(*place, TileRow.state, TileRow.seq, TileRow.attempt, TileRow.crc32)
            return [tuple(row) for row in session.execute(query.order_by(*place))]


@contextmanager
def pair(data: Path, url: str, *, first_url: str | None = None, module: str = "service") -> Iterator[Pair]:
    """Start two servers; the first may reach the database by another way, and run another module."""
    settings = Settings(data=data, database=url, port=0, workers=1, tile_size=48, log_level="error")
    database = Database(url)
    with (
        running(settings.model_copy(update={"database": first_url or url}), module=module) as first,
        running(settings) as second,
    ):
        yield Pair(first, second, database)
    database.close()


def leads(server: RunningServer) -> bool:
    return "penumbra_leads 1.0" in httpx2.get(f"{server.url}/metrics", timeout=TIMEOUT).text


def half_done(client: httpx2.Client, **request: Any) -> str:
    job = submit(client, work(), **request)
    wait(client, job, lambda found: found["progress"]["done"] >= 3)
    return job
