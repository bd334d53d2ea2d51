"""Jobs that are cancelled or deleted, queued, running, or while nobody hands out work."""

import os
from contextlib import suppress
from pathlib import Path

import httpx2
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.server import RunningServer
from service.settings import Settings
from tests.service.conftest import Start
from tests.service.processes import held, workers_of
from tests.service.sending import client_of
from tests.service.support import finish, job_of, long_scene, scene, submit, until, wait


def files_of(server: RunningServer, job: str) -> dict[Path, int]:
    """Files of a job and when they were written; tiles that are being deleted meanwhile are left out."""
    found = {}
    for folder, _, names in os.walk(server.data / "jobs" / job):
        for path in (Path(folder, name) for name in names):
            with suppress(FileNotFoundError):
                found[path] = path.stat().st_mtime_ns
    return found


def test_running_job_writes_nothing_afterwards(client: httpx2.Client, server: RunningServer) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["progress"]["done"] > 2)
    cancelled = client.post(f"/v1/jobs/{job}/cancel").json()
    assert cancelled["state"] == "cancelled"
    files, steps = files_of(server, job), cancelled["progress"]["done"]
    done = submit(client, scene())
    finish(client, done)  # the workers are free for others
    assert files_of(server, job).items() <= files.items()
    assert job_of(client, job)["progress"]["done"] == steps
    for name in ("image.png", "image.npy", "image.exr"):
        answer = client.get(f"/v1/jobs/{job}/{name}")
        assert (answer.status_code, answer.json()["code"]) == (410, "picture_gone")
    # Too late or again, it changes nothing.
    for each in (job, done):
        before = job_of(client, each)
        answer = client.post(f"/v1/jobs/{each}/cancel")
        assert (answer.status_code, answer.json()) == (200, before)


@pytest.mark.slow
def test_job_is_cancelling_while_nobody_hands_out_work(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path, workers=1, tile_size=32, log_level="error")
    with TestClient(create_app(settings), base_url="http://127.0.0.1") as client:
        job = client.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
        until(lambda: job_of(client, job)["state"] == "running")
        # As if another server handed out the work, and did not answer.
        client.app.state.service.dispatcher.stop()
        answer = client.post(f"/v1/jobs/{job}/cancel")
        assert (answer.status_code, answer.json()["state"]) == (202, "running")
        assert answer.json()["cancelling"] is True
        assert job_of(client, job)["cancelling"] is True
    # The next leader ends the cancelled render.
    with TestClient(create_app(settings), base_url="http://127.0.0.1") as client:
        until(lambda: job_of(client, job)["state"] == "cancelled")
        again = client.post(f"/v1/jobs/{job}/cancel")
        assert (again.status_code, again.json()["cancelling"]) == (200, False)


@pytest.mark.slow
def test_queued_job_never_begins(start: Start) -> None:
    server = start(workers=1)
    with client_of(server) as client:
        until(lambda: len(workers_of(server.process.pid)) == 1)
        # While the only worker does nothing, no job after those it was given comes to its turn.
        with held(*workers_of(server.process.pid)):
            *_, last = (submit(client, long_scene()) for _ in range(8))
            found = job_of(client, last)
            assert found["state"] == "queued"
            assert found["queue_position"] > 0
            cancelled = client.post(f"/v1/jobs/{last}/cancel").json()
            assert (cancelled["state"], cancelled["started_at"]) == ("cancelled", None)
