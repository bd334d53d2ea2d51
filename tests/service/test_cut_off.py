"""A server that loses its connection to the shared database, or is killed: another takes over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import httpx2
import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.engine import make_url
from sqlalchemy.exc import OperationalError

from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database import connection
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow, TileRow
from tests.postgres_server import PostgresServer
from tests.service.between import Between
from tests.service.support import TIMEOUT, finish, image, scene, submit, until, wait, work


@pytest.fixture(scope="module")
def between(postgres: PostgresServer) -> Iterator[Between]:
    started = Between(str(postgres.folder / ".s.PGSQL.5432"))
    yield started
    started.close()


@dataclass
class Pair:
    """Two servers on one database, of which the far one reaches it through a process between them.

    The far one renders for ever what is called endless.
    """

    far: RunningServer
    near: RunningServer
    database: Database


@pytest.fixture(scope="module")
def pair(
    tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer, between: Between
) -> Iterator[Pair]:
    data, url = tmp_path_factory.mktemp("shared"), postgres.database()
    database = Database(url)
    with (
        running(_settings(data, through(between, url)), module="benchmarks.chaos.faulty") as far,
        running(_settings(data, url)) as near,
    ):
        yield Pair(far, near, database)
    database.close()


def _settings(data: Path, url: str) -> Settings:
    return Settings(data=data, database=url, port=0, workers=1, tile_size=48, log_level="error")


def through(between: Between, url: str) -> str:
    """The address of the same database by another way."""
    return f"postgresql+psycopg://postgres@127.0.0.1:{between.port}/{make_url(url).database}"


def client_of(server: RunningServer) -> httpx2.Client:
    return httpx2.Client(base_url=server.url, timeout=TIMEOUT)


def leads(server: RunningServer) -> bool:
    return "penumbra_leads 1.0" in httpx2.get(f"{server.url}/metrics", timeout=TIMEOUT).text


def steps(database: Database) -> list[tuple[object, ...]]:
    """All steps, with who has them."""
    with database.reading() as session:
        query = select(TileRow.render, TileRow.pass_index, TileRow.tile, TileRow.state, TileRow.attempt)
        return [tuple(row) for row in session.execute(query.order_by(*query.selected_columns[:3]))]


@pytest.mark.slow
def test_a_leader_that_is_cut_off_is_followed_and_gives_up_all_it_has_when_it_is_back(
    pair: Pair, between: Between, undisturbed: np.ndarray
) -> None:
    assert leads(pair.far)
    with client_of(pair.near) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        endless = submit(client, scene() | {"name": "endless"})
        wait(client, endless, lambda found: found["state"] == "running")
        between.swallow()
        until(lambda: leads(pair.near))
        finish(client, job)
        finish(client, endless)
        assert image(client, job).tobytes() == undisturbed.tobytes()
        rows = steps(pair.database)
        between.pass_on()
        until(lambda: not leads(pair.far))
    assert steps(pair.database) == rows
    assert leads(pair.near)
    with client_of(pair.far) as client:
        assert image(client, job).tobytes() == undisturbed.tobytes()
        # Its worker is free: its task was abandoned.
        rays = {"scene": scene(), "origins": [[0.0, 2.0, 6.0]], "directions": [[0.0, -1.0, -5.0]]}
        assert client.post("/v1/traces", json=rays).status_code == 200


@pytest.mark.slow
def test_a_leader_that_is_ended_hands_over_at_once(pair: Pair, undisturbed: np.ndarray) -> None:
    leader, other = (pair.far, pair.near) if leads(pair.far) else (pair.near, pair.far)
    with client_of(other) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        with pair.database.writing() as session:
            # The leader's term lasts an hour here.
            session.scalars(select(LeaderRow)).one().expires_at += timedelta(hours=1)
        leader.process.terminate()
        until(lambda: leads(other))
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()


def test_a_database_that_does_not_answer_is_given_up(
    postgres: PostgresServer, between: Between, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "ANSWER_SECONDS", 0.5)
    database = Database(f"{through(between, postgres.database())}?connect_timeout=2")

    def ask() -> int:
        with database.reading() as session:
            return session.connection().exec_driver_sql("SELECT 1").scalar_one()

    assert ask() == 1
    between.swallow()
    try:
        with pytest.raises(OperationalError):
            ask()
    finally:
        between.pass_on()
    assert ask() == 1
    database.close()
