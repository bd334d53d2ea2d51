"""A full queue refuses jobs with Retry-After; no accepted job is lost."""

from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

import httpx2
import pytest

from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.conftest import Start
from tests.service.processes import held, workers_of
from tests.service.sending import client_of
from tests.service.support import finish, scene, until


def ask(client: httpx2.Client, number: int) -> httpx2.Response:
    """Submit a scene like no other."""
    document = scene(32, 32, samples=1, light_samples=1)
    document["camera"]["position"][0] = number / 8
    return client.post("/v1/jobs", json={"scene": document})


def codes(client: httpx2.Client, *numbers: int) -> list[int]:
    return [ask(client, number).status_code for number in numbers]


def suspended(server: RunningServer) -> AbstractContextManager[None]:
    """While its worker does nothing, the queue stays as long as it is."""
    until(lambda: len(workers_of(server.process.pid)) == 1)
    return held(*workers_of(server.process.pid))


@pytest.fixture
def price(client: httpx2.Client) -> float:
    """Predicted cost of a scene of these tests, CPU seconds."""
    plan = client.post("/v1/plans", json={"scene": scene(32, 32, samples=1, light_samples=1)}).json()
    return plan["cost"]["cpu_seconds"]


@pytest.mark.slow
def test_full_queue_says_when_to_come_back(start: Start) -> None:
    server = start(workers=1, max_user_jobs=3)
    with client_of(server) as client:
        finish(client, ask(client, 0).json()["id"])
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
            # A job that is answered from the store needs no room in the queue.
            assert ask(client, 0).json()["state"] == "succeeded"
        for answer in taken:
            finish(client, answer.json()["id"])
        assert ask(client, 4).status_code == 202


@pytest.mark.slow
def test_queue_of_one_user_is_not_anothers(start: Start, tmp_path: Path, price: float) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        made = [
            keys.add(session, "ann", Role.SUBMIT, max_jobs=1),
            keys.add(session, "bob", Role.SUBMIT),
            keys.add(session, "eve", Role.SUBMIT, max_cpu_seconds=0.5 * price),
            keys.add(session, "dan", Role.SUBMIT, max_cpu_seconds=1.5 * price),
        ]
    database.close()
    server = start(workers=1, max_queued_jobs=4)
    with ExitStack() as stack:
        ann, bob, eve, dan = (stack.enter_context(client_of(server, str(key))) for key in made)
        stack.enter_context(suspended(server))
        # Too dear for its user for good.
        assert ask(eve, 0).json()["errors"][0]["code"] == "cost"
        assert codes(ann, 1, 2) == [202, 429]
        # Two jobs share a render: with the first of them its cost stays in the queue.
        first, _ = [ask(dan, 6).json()["id"] for _ in range(2)]
        assert codes(dan, 7) == [429]
        assert dan.post(f"/v1/jobs/{first}/cancel").json()["state"] == "cancelled"
        assert codes(dan, 7) == [429]
        assert codes(bob, 3, 4, 5) == [202, 202, 429]
