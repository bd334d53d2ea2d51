"""Several servers on one PostgreSQL: one hands out work, all answer, and another takes over."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.engine import make_url

from service.storage.database.models import LeaderRow
from tests.postgres_server import PostgresServer
from tests.service.between import Between
from tests.service.failover import Pair, half_done, leads, pair
from tests.service.sending import client_of
from tests.service.support import ended, finish, image, job_of, long_scene, scene, submit, until, wait, work

pytestmark = pytest.mark.slow

RAYS = {"scene": scene(), "origins": [[0.0, 2.0, 6.0]], "directions": [[0.0, -1.0, -5.0]]}
FAILOVER_SECONDS = 5.0


@pytest.fixture(scope="module")
def between(postgres: PostgresServer) -> Iterator[Between]:
    started = Between(str(postgres.folder / ".s.PGSQL.5432"))
    yield started
    started.close()


@pytest.fixture(scope="module")
def two(
    tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer, between: Between
) -> Iterator[Pair]:
    """The first server reaches the database through a process between, and renders some scenes for ever."""
    url = postgres.database()
    through = f"postgresql+psycopg://postgres@127.0.0.1:{between.port}/{make_url(url).database}"
    with pair(
        tmp_path_factory.mktemp("shared"), url, first_url=through, module="tests.service.faulty"
    ) as started:
        yield started


def test_whichever_server_is_asked_answers_the_same(two: Pair) -> None:
    assert (leads(two.first), leads(two.second)) == (True, False)
    with client_of(two.first) as first, client_of(two.second) as second:
        job = submit(second, scene(160, 96))
        with second.stream("GET", f"/v1/jobs/{job}/events") as answer:
            assert any(line == "event: end" for line in answer.iter_lines())
        assert image(first, job).tobytes() == image(second, job).tobytes()

        running = submit(first, long_scene())
        wait(second, running, lambda found: found["progress"]["done"] >= 2)
        assert second.post(f"/v1/jobs/{running}/cancel").json()["state"] == "cancelled"
        assert job_of(first, running)["state"] == "cancelled"
        assert [client.post("/v1/traces", json=RAYS).status_code for client in (first, second)] == [200, 200]

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


def test_jobs_wait_while_the_database_is_away(
    two: Pair, postgres: PostgresServer, undisturbed: np.ndarray
) -> None:
    with client_of(two.second) as client:
        job = half_done(client)
        postgres.stop()
        try:
            reported = [client.get(f"/v1/jobs/{job}"), client.post("/v1/jobs", json={"scene": scene()})]
            ready = client.get("/readyz")
        finally:
            postgres.start()
        assert [answer.status_code for answer in reported] == [503, 503]
        assert {answer.headers["Content-Type"] for answer in reported} == {"application/problem+json"}
        assert all(int(answer.headers["Retry-After"]) > 0 for answer in reported)
        assert ready.status_code == 503
        assert client.get("/readyz").status_code == 200
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()


def test_leader_that_is_cut_off_gives_up_its_work(
    two: Pair, between: Between, undisturbed: np.ndarray
) -> None:
    until(lambda: leads(two.first) != leads(two.second))
    if leads(two.second):
        two.second.process.send_signal(signal.SIGSTOP)
        until(lambda: leads(two.first))
        two.second.process.send_signal(signal.SIGCONT)
        until(lambda: not leads(two.second))
    with client_of(two.second) as client:
        job = half_done(client)
        endless = submit(client, scene() | {"name": "endless"})
        wait(client, endless, lambda found: found["state"] == "running")
        between.swallow()
        until(lambda: leads(two.second))
        finish(client, job)
        finish(client, endless)
        assert image(client, job).tobytes() == undisturbed.tobytes()
        rows = two.steps()
        between.pass_on()
        until(lambda: not leads(two.first))
    assert two.steps() == rows
    assert leads(two.second)
    with client_of(two.first) as client:
        assert image(client, job).tobytes() == undisturbed.tobytes()
        # Its worker is free: its task was abandoned.
        assert client.post("/v1/traces", json=RAYS).status_code == 200


def test_leader_that_is_stopped_loses_nothing(two: Pair, undisturbed: np.ndarray) -> None:
    leader, other = two.leader_and_other()
    with client_of(other) as client:
        job = half_done(client)
        os.kill(leader.process.pid, signal.SIGSTOP)
        assert not ended(job_of(client, job))
        done = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        until(lambda: leads(other), seconds=FAILOVER_SECONDS)
        finish(client, job)
        assert client.get(f"/v1/jobs/{job}/tiles").json()["events"][: len(done)] == done
        assert image(client, job).tobytes() == undisturbed.tobytes()
    rows = two.steps()
    os.kill(leader.process.pid, signal.SIGCONT)
    until(lambda: not leads(leader))
    assert two.steps() == rows


@pytest.mark.parametrize("kill", [False, True], ids=["terminated", "killed"])
def test_leader_that_ends_is_followed(
    kill: bool, tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer, undisturbed: np.ndarray
) -> None:
    with pair(tmp_path_factory.mktemp("shared"), postgres.database()) as two:
        leader, other = two.leader_and_other()
        with client_of(other) as client:
            job = submit(client, work())
            wait(client, job, lambda found: found["progress"]["done"] >= 3)
            if kill:
                leader.process.kill()
            else:
                # One that ends by itself hands over at once, though its term lasts an hour.
                with two.database.writing() as session:
                    session.scalars(select(LeaderRow)).one().expires_at += timedelta(hours=1)
                leader.process.terminate()
            until(lambda: leads(other), seconds=FAILOVER_SECONDS)
            finish(client, job)
            assert image(client, job).tobytes() == undisturbed.tobytes()
