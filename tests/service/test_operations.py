"""Routes for operators, and the documentation of operations."""

from __future__ import annotations

import os
import signal
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from importlib.metadata import version
from pathlib import Path

import httpx2
import jsonschema_rs
import pytest
from starlette.testclient import TestClient

from benchmarks.load.processes import fork_servers_of, workers_of
from schemas.json_schema import scene_json_schema
from service.app import create_app
from service.settings import Settings
from tests.service.conftest import Start
from tests.service.lifecycle.test_cancelling import stopped
from tests.service.support import TIMEOUT, scene, until

# The number of threads that answer requests.
REQUEST_THREADS = 40


def test_a_running_service_says_that_it_is_well(client: httpx2.Client) -> None:
    assert [client.get(path).json() for path in ("/livez", "/readyz")] == [{"status": "ok"}] * 2


def test_a_service_says_which_one_it_is(client: httpx2.Client) -> None:
    expected = {"name": "penumbra", "version": version("penumbra-render"), "api": "v1"}
    assert client.get("/version").json() == expected


def test_the_schema_of_scenes_takes_scenes_and_nothing_else(client: httpx2.Client) -> None:
    published = client.get("/v1/schemas/scene.json").json()
    assert published == scene_json_schema()
    schema = jsonschema_rs.validator_for(published)
    assert schema.is_valid(scene())
    assert not schema.is_valid(scene() | {"shapes": [{"type": "cube"}]})
    assert not schema.is_valid(scene() | {"unknown": 1})


def test_a_service_whose_disk_is_nearly_full_takes_no_jobs_and_lives(tmp_path: Path) -> None:
    # More than any disk has.
    app = create_app(Settings(data=tmp_path, workers=1, min_free_bytes=1 << 62))
    with TestClient(app) as client:
        assert "disk" in missing(client)


def test_a_service_whose_folder_takes_no_files_takes_no_jobs_and_lives(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, workers=1))
    with TestClient(app) as client:
        until(lambda: client.get("/readyz").status_code == 200)
        (tmp_path / "jobs").rmdir()
        (tmp_path / "jobs").touch()
        assert missing(client).removeprefix("Not ready: ").startswith("the data folder")
        (tmp_path / "jobs").unlink()
        assert client.get("/readyz").status_code == 200


def test_a_service_that_is_being_stopped_takes_no_jobs_and_lives(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, workers=1))
    with TestClient(app) as client:
        app.state.service.job_events.close()
        assert "being stopped" in missing(client)


def test_a_service_without_a_worker_takes_no_jobs_and_lives(start: Start) -> None:
    server = start(workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        (worker,) = workers_of(server.process.pid)
        # Another one would be forked at once.
        with stopped(*fork_servers_of(server.process.pid)):
            os.kill(worker, signal.SIGKILL)
            until(lambda: client.get("/readyz").status_code == 503)
            assert missing(client).removeprefix("Not ready: ").startswith("no worker")
        until(lambda: client.get("/readyz").status_code == 200)


def missing(client: httpx2.Client) -> str:
    """What a service says that lives and is not ready."""
    answer = client.get("/readyz")
    assert (answer.status_code, client.get("/livez").status_code) == (503, 200)
    detail: str = answer.json()["detail"]
    return detail


@pytest.mark.slow
def test_a_service_whose_database_takes_no_writes_is_not_ready(start: Start, tmp_path: Path) -> None:
    with httpx2.Client(base_url=start(workers=1).url, timeout=TIMEOUT) as client:
        with closing(sqlite3.connect(tmp_path / "penumbra.sqlite")) as connection:
            connection.execute("PRAGMA busy_timeout = 10000")
            connection.execute("BEGIN IMMEDIATE")
            assert "the database" in missing(client)
            connection.rollback()
        assert client.get("/readyz").status_code == 200


@pytest.mark.slow
def test_a_service_of_which_all_threads_wait_for_the_database_lives(start: Start, tmp_path: Path) -> None:
    server = start(workers=1)
    threads = Path(f"/proc/{server.process.pid}/task")
    with (
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
        ThreadPoolExecutor(REQUEST_THREADS) as pool,
        closing(sqlite3.connect(tmp_path / "penumbra.sqlite")) as connection,
    ):
        connection.execute("PRAGMA busy_timeout = 10000")
        job = client.post("/v1/jobs", json={"scene": scene(8, 8)}).json()["id"]
        before = len(list(threads.iterdir()))
        connection.execute("BEGIN IMMEDIATE")
        waiting = [pool.submit(client.put, f"/v1/jobs/{job}/pin") for _ in range(REQUEST_THREADS)]
        until(lambda: len(list(threads.iterdir())) >= max(before, REQUEST_THREADS))
        assert client.get("/livez").status_code == 200
        assert not any(request.done() for request in waiting)
        connection.rollback()
        assert {request.result().status_code for request in waiting} == {200}


def test_a_service_that_hands_out_no_work_any_more_asks_to_be_started_again(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, workers=1))
    with TestClient(app) as client:
        assert client.get("/livez").status_code == 200
        app.state.service.dispatcher.stop()
        answer = client.get("/livez")
        assert answer.status_code == 503
        assert "Restart" in answer.json()["detail"]
        assert client.get("/readyz").status_code == 503
