"""A full queue refuses jobs with Retry-After; no accepted job is lost."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest

from benchmarks.load.processes import workers_of
from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, finish, scene, until


def ask(client: httpx2.Client, number: int) -> httpx2.Response:
    """Submit a scene like no other."""
    document = scene(32, 32, samples=1, light_samples=1)
    document["camera"]["position"][0] = number / 8
    return client.post("/v1/jobs", json={"scene": document})


@contextmanager
def suspended(server: RunningServer) -> Iterator[None]:
    """While workers do nothing, the queue stays as long as it is."""
    until(lambda: len(workers_of(server.process.pid)) == 1)
    workers = workers_of(server.process.pid)
    for worker in workers:
        os.kill(worker, signal.SIGSTOP)
    try:
        yield
    finally:
        for worker in workers:
            os.kill(worker, signal.SIGCONT)


def test_a_full_queue_says_when_to_come_back_and_loses_nothing(start: Start) -> None:
    server = start(workers=1, max_user_jobs=3)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        done = ask(client, 0)
        finish(client, done.json()["id"])
        with suspended(server):
            taken = [ask(client, number) for number in (1, 2, 3)]
            assert [answer.status_code for answer in taken] == [202] * 3
            left = [answer.headers["RateLimit"] for answer in taken]
            assert left == [f'"jobs";r={count}, "cpu";r=99999' for count in (2, 1, 0)]
            assert taken[0].headers["RateLimit-Policy"].startswith('"jobs";q=3;qu="requests", "cpu";q=100000')
            full = ask(client, 4)
            assert (full.status_code, full.json()["code"]) == (429, "queue_full")
            assert 1 <= int(full.headers["Retry-After"]) <= 3600
            assert full.headers["RateLimit"].startswith('"jobs";r=0')
            assert "3 jobs" in full.json()["detail"]
            # A job that is answered from the store needs no room in the queue.
            assert ask(client, 0).json()["state"] == "succeeded"
        for answer in taken:
            finish(client, answer.json()["id"])
        assert ask(client, 4).status_code == 202


@pytest.fixture
def price(client: httpx2.Client) -> float:
    """What a scene of these tests is predicted to cost, CPU seconds."""
    plan = client.post("/v1/plans", json={"scene": scene(32, 32, samples=1, light_samples=1)}).json()
    return plan["cost"]["cpu_seconds"]


def test_cpu_seconds_are_counted_too_and_not_twice_for_one_picture(start: Start, price: float) -> None:
    server = start(workers=1, max_user_cpu_seconds=1.5 * price)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client, suspended(server):
        assert [ask(client, number).status_code for number in (1, 1, 2)] == [202, 202, 429]


def test_a_job_that_is_too_dear_for_its_user_is_refused_for_good(start: Start, price: float) -> None:
    server = start(workers=1, max_user_cpu_seconds=0.5 * price)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        answer = ask(client, 1)
        assert (answer.status_code, answer.json()["errors"][0]["code"]) == (422, "cost")


def test_one_users_full_queue_is_not_anothers(start: Start, tmp_path: Path) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        ann = keys.add(session, "ann", Role.SUBMIT, max_jobs=1)
        bob = keys.add(session, "bob", Role.SUBMIT)
    database.close()
    server = start(workers=1, max_queued_jobs=3)
    clients = [
        httpx2.Client(base_url=server.url, timeout=TIMEOUT, headers={"Authorization": f"Bearer {key}"})
        for key in (ann, bob)
    ]
    with clients[0] as first, clients[1] as second, suspended(server):
        assert [ask(first, number).status_code for number in (1, 2)] == [202, 429]
        assert [ask(second, number).status_code for number in (3, 4, 5)] == [202, 202, 429]
        assert ask(second, 6).json()["detail"].startswith("The queue is full")
