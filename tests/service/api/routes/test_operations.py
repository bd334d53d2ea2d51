"""Routes for operators: health checks, version, metrics."""

import os
import signal
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from importlib.metadata import version
from pathlib import Path
from typing import Any

import httpx2
import pytest

from service.server import RunningServer
from service.settings import Settings
from tests.service.conftest import Start
from tests.service.in_process import InProcess, in_process
from tests.service.processes import fork_servers_of, held, workers_of
from tests.service.sending import SMALL, client_of, png, problem_of, put, textured
from tests.service.support import API_ON_BOTH, long_scene, scene, submit, until

WRITERS = 12
"""More than there are places for reading requests; of one client not many more are handled at once."""


def missing(client: httpx2.Client) -> str:
    """Health of a service that is alive and not ready."""
    assert client.get("/livez").status_code == 200
    detail: str = problem_of(client.get("/readyz"), 503)["detail"]
    return detail


def test_health_and_version_are_told_to_everyone(api: httpx2.Client) -> None:
    assert api.get("/livez").json() == {"status": "ok"}
    # The first worker may not have started yet.
    until(lambda: api.get("/readyz").json() == {"status": "ok"})
    expected = {"name": "penumbra", "version": version("penumbra-render"), "api": "v1"}
    assert api.get("/version").json() == expected


@API_ON_BOTH
def test_users_are_listed_with_what_they_use(api: httpx2.Client) -> None:
    content = png(5, 7)
    assert put(api, content).status_code == 200
    answer = api.post("/v1/jobs", json=SMALL, headers={"Prefer": "wait=30", "Cache-Control": "no-cache"})
    size = len(api.get(f"/v1/jobs/{answer.json()['id']}/image.npy").content)
    [local] = [user for user in api.get("/v1/users").json()["users"] if user["user"] == "local"]
    assert local["open_jobs"] == 0
    assert local["stored_bytes"] > size + len(content)
    assert local["cpu_seconds"] > 0
    assert api.get("/v1/users", params={"cursor": "local"}).json()["users"] == []


@pytest.mark.slow
def test_workers_are_listed_with_whom_they_work_for(server: RunningServer, client: httpx2.Client) -> None:
    def busy(task: str) -> list[dict[str, Any]]:
        return [one for one in client.get("/v1/workers").json()["workers"] if one["task"] == task]

    with ThreadPoolExecutor(1) as pool:
        pool.submit(client.post, "/v1/quotes", json={"scene": long_scene()})
        until(lambda: [worker["users"] for worker in busy("quote")] == [["local"]])
    job = submit(client, long_scene())
    # A tile ends and the next one begins: between two requests none may run.
    seen: list[dict[str, Any]] = []
    until(lambda: bool(seen.extend(busy("tile")) or seen))
    worker = seen[0]
    assert (worker["users"], worker["jobs"]) == (["local"], [job])
    assert worker["pid"] in workers_of(server.process.pid)
    assert worker["memory_bytes"] > 10_000_000
    client.delete(f"/v1/jobs/{job}")


@pytest.fixture
def own(tmp_path: Path) -> Iterator[tuple[InProcess, httpx2.Client]]:
    """A service of one's own, which may be harmed."""
    with in_process(Settings(data=tmp_path, workers=1)) as local, local.client() as client:
        until(lambda: client.get("/readyz").status_code == 200)
        yield local, client


def test_health_tells_of_a_folder_that_takes_no_files(
    own: tuple[InProcess, httpx2.Client], tmp_path: Path
) -> None:
    _, client = own
    (tmp_path / "jobs").rmdir()
    (tmp_path / "jobs").touch()
    assert "data folder" in missing(client)
    (tmp_path / "jobs").unlink()
    assert client.get("/readyz").status_code == 200


@pytest.mark.slow
def test_health_tells_of_a_disk_that_is_nearly_full(tmp_path: Path) -> None:
    # More than any disk has.
    with in_process(Settings(data=tmp_path, workers=1, min_free_bytes=1 << 50)) as local:
        assert "disk" in missing(local.client())


def test_health_tells_of_an_end_and_of_a_dispatcher_that_is_gone(
    own: tuple[InProcess, httpx2.Client],
) -> None:
    local, client = own
    local.service.job_events.close()
    assert "stopped" in missing(client)
    local.service.dispatcher.stop()
    problem_of(client.get("/livez"), 503)
    problem_of(client.get("/readyz"), 503)


@pytest.mark.slow
def test_health_tells_of_a_missing_worker(start: Start) -> None:
    server = start(workers=1)
    with client_of(server) as client:
        (worker,) = workers_of(server.process.pid)
        # Another one would be forked at once.
        with held(*fork_servers_of(server.process.pid)):
            os.kill(worker, signal.SIGKILL)
            until(lambda: client.get("/readyz").status_code == 503)
            assert "worker" in missing(client)
        until(lambda: client.get("/readyz").status_code == 200)


@pytest.mark.slow
def test_database_that_takes_no_writes_holds_back_writers_alone(start: Start, tmp_path: Path) -> None:
    """They are all refused at the same time, however many they are; nobody else waits for them."""
    server = start(workers=1)
    body = {"scene": scene(8, 8)}
    with (
        client_of(server) as client,
        ThreadPoolExecutor(WRITERS + 1) as pool,
        closing(sqlite3.connect(tmp_path / "penumbra.sqlite")) as connection,
    ):
        job = client.post("/v1/jobs", json=body).json()["id"]
        connection.execute("PRAGMA busy_timeout = 10000")
        connection.execute("BEGIN IMMEDIATE")
        begun = time.monotonic()
        waiting = [pool.submit(client.put, f"/v1/jobs/{job}/pin") for _ in range(WRITERS // 2)]
        waiting += [
            pool.submit(client.post, "/v1/jobs", json=body | {"labels": {"number": str(number)}})
            for number in range(WRITERS // 2)
        ]
        health = pool.submit(missing, client)
        assert client.get("/livez").status_code == 200
        assert client.get("/v1/jobs").json()["jobs"][0]["id"] == job
        assert client.post("/v1/plans", json=body).status_code == 200
        wrong = client.post("/v1/plans", json={"scene": textured("sha256:" + "0" * 64)})
        assert problem_of(wrong, 422)["errors"][0]["line"] == 1
        assert not any(request.done() for request in waiting)
        assert {request.result().status_code for request in waiting} == {503}
        assert "database" in health.result()
        # Two waits one after another would be twenty.
        assert time.monotonic() - begun < 18
        connection.rollback()
        assert client.put(f"/v1/jobs/{job}/pin").status_code == 200
        assert client.get("/readyz").status_code == 200
