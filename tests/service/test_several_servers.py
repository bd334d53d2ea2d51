"""Several servers on one PostgreSQL and one data folder: one hands out work, all answer."""

from __future__ import annotations

import os
import secrets
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from itertools import takewhile

import httpx2
import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from service.dispatch.leadership import Leadership
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow, TileRow
from tests.postgres_server import PostgresServer
from tests.service.support import (
    TIMEOUT,
    ended,
    finish,
    image,
    job_of,
    long_scene,
    scene,
    submit,
    until,
    wait,
    work,
)

FAILOVER_SECONDS = 5.0


@pytest.fixture
def two(postgres: PostgresServer) -> Iterator[tuple[Database, Database]]:
    """The same database, opened as two servers do."""
    first = postgres.emptied()
    second = Database(first.engine.url.render_as_string(hide_password=False))
    yield first, second
    first.close()
    second.close()


def term(database: Database, leadership: Leadership) -> int | None:
    with database.writing() as session:
        return leadership.stand(session)


def test_one_leads_until_it_resigns(two: tuple[Database, Database]) -> None:
    first, second = (Leadership(database) for database in two)
    begun = term(two[0], first)
    assert begun is not None
    assert [term(two[1], second), term(two[0], first)] == [None, begun]
    with two[0].writing() as session:
        first.resign(session)
    assert [term(two[1], second), term(two[0], first)] == [begun + 1, None]


def test_who_was_silent_for_too_long_is_followed_and_learns_of_it(two: tuple[Database, Database]) -> None:
    first, second = (Leadership(database) for database in two)
    begun = term(two[0], first)
    assert begun is not None
    with two[1].writing() as session:
        session.scalars(select(LeaderRow)).one().expires_at -= timedelta(minutes=1)
    assert [term(two[1], second), term(two[0], first)] == [begun + 1, None]
    with two[1].writing() as session:
        second.resign(session)
    # Results of its first term are ignored.
    assert term(two[0], first) == begun + 2


def test_a_server_that_stops_in_the_middle_of_a_transaction_writes_nothing_and_blocks_no_other(
    two: tuple[Database, Database],
) -> None:
    def stop_in_the_middle() -> None:
        with two[0].writing() as session:
            leader = session.scalars(select(LeaderRow)).one()
            leader.term += 100
            session.flush()
            # Waits until the first one is cut off, because only one writes at a time.
            with two[1].writing() as other:
                found.append(other.scalars(select(LeaderRow.term)).one())

    found: list[int] = []
    with pytest.raises(SQLAlchemyError):
        stop_in_the_middle()
    with two[1].reading() as session:
        assert [session.scalars(select(LeaderRow.term)).one()] == found


@pytest.mark.parametrize("count", [1, 450])
def test_another_server_learns_of_each_job_however_many_change_at_once(
    two: tuple[Database, Database], count: int
) -> None:
    """Ids of 450 jobs are longer than a notice may be."""
    ids = {secrets.token_hex(16) for _ in range(count)}
    stopping = threading.Event()
    notices = two[0].notices(stopping)
    assert next(notices) == {}
    with two[1].writing() as session:
        two[1].notify_jobs(session, ids)
        two[1].notify(session, last=True)
    known = list(takewhile(lambda notice: "last" not in notice, notices))
    stopping.set()
    assert sorted(job for notice in known for job in notice["jobs"]) == sorted(ids)


def leads(server: RunningServer) -> bool:
    return "penumbra_leads 1.0" in httpx2.get(f"{server.url}/metrics", timeout=TIMEOUT).text


def client_of(server: RunningServer) -> httpx2.Client:
    return httpx2.Client(base_url=server.url, timeout=TIMEOUT)


Pair = tuple[RunningServer, RunningServer, Database]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer) -> Iterator[Pair]:
    """The leader, a server that does not lead, and their database."""
    url, data = postgres.database(), tmp_path_factory.mktemp("shared")
    settings = Settings(data=data, database=url, port=0, workers=1, tile_size=48, log_level="error")
    database = Database(url)
    with running(settings) as leader, running(settings) as other:
        yield leader, other, database
    database.close()


@pytest.mark.slow
def test_whichever_server_is_asked_does_and_reports_the_same(
    pair: Pair,
) -> None:
    leader, other, _ = pair
    assert (leads(leader), leads(other)) == (True, False)
    with client_of(leader) as first, client_of(other) as second:
        job = submit(second, scene(160, 96))
        with second.stream("GET", f"/v1/jobs/{job}/events") as answer:
            assert any(line == "event: end" for line in answer.iter_lines())
        assert image(first, job).tobytes() == image(second, job).tobytes()

        running = submit(first, long_scene())
        wait(second, running, lambda found: found["progress"]["done"] >= 2)
        assert second.post(f"/v1/jobs/{running}/cancel").json()["state"] == "cancelled"
        assert job_of(first, running)["state"] == "cancelled"

        rays = {"scene": scene(), "origins": [[0.0, 2.0, 6.0]], "directions": [[0.0, -1.0, -5.0]]}
        answers = [client.post("/v1/traces", json=rays).status_code for client in (first, second)]
        assert answers == [200, 200]

        def ask(number: int) -> str:
            headers = {"Idempotency-Key": f"key{number // 2}"}
            client = (first, second)[number % 2]
            return client.post("/v1/jobs", json={"scene": scene(24, 24)}, headers=headers).json()["id"]

        with ThreadPoolExecutor(8) as pool:
            jobs = list(pool.map(ask, range(16)))
        assert jobs[::2] == jobs[1::2]
        assert len(set(jobs)) == 8
        for made in set(jobs):
            finish(second, made)


@pytest.mark.slow
def test_while_the_database_is_away_jobs_wait_and_requests_get_503_with_retry_after(
    pair: Pair, postgres: PostgresServer, undisturbed: np.ndarray
) -> None:
    with client_of(pair[1]) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        postgres.stop()
        try:
            reported = [client.get(f"/v1/jobs/{job}"), client.post("/v1/jobs", json={"scene": scene()})]
            ready = client.get("/readyz")
        finally:
            postgres.start()
        assert [answer.status_code for answer in reported] == [503, 503]
        assert {answer.headers["Content-Type"] for answer in reported} == {"application/problem+json"}
        assert all(int(answer.headers["Retry-After"]) > 0 for answer in reported)
        assert "the database" in ready.json()["detail"]
        assert client.get("/readyz").status_code == 200
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()


@pytest.mark.slow
def test_when_the_leader_stops_or_dies_another_continues_and_loses_nothing(
    pair: Pair, undisturbed: np.ndarray
) -> None:
    database = pair[2]
    until(lambda: leads(pair[0]) != leads(pair[1]))
    leader, other = pair[:2] if leads(pair[0]) else pair[1::-1]
    with client_of(other) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        os.kill(leader.process.pid, signal.SIGSTOP)
        assert not ended(job_of(client, job))
        done = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        until(lambda: leads(other), seconds=FAILOVER_SECONDS)
        finish(client, job)
        assert client.get(f"/v1/jobs/{job}/tiles").json()["events"][: len(done)] == done
        assert image(client, job).tobytes() == undisturbed.tobytes()
    rows = steps(database)

    os.kill(leader.process.pid, signal.SIGCONT)
    until(lambda: not leads(leader))
    assert steps(database) == rows
    with client_of(leader) as client:
        assert image(client, job).tobytes() == undisturbed.tobytes()
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        other.process.kill()
        until(lambda: leads(leader), seconds=FAILOVER_SECONDS)
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()


def steps(database: Database) -> list[tuple[object, ...]]:
    """All finished steps, with who finished them."""
    with database.reading() as session:
        query = select(TileRow.render, TileRow.seq, TileRow.attempt, TileRow.crc32)
        return [tuple(row) for row in session.execute(query.order_by(TileRow.render, TileRow.seq))]
