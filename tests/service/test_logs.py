"""The log of a job, derived from its rows."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import httpx2
import pytest

from benchmarks.load.processes import workers_of
from service.client import Client
from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.support import kill_at_work, long_scene, scene, until, wait
from tests.service.test_assets import put
from tests.service.test_meshes import FILES, with_mesh


def log_of(client: httpx2.Client, job: str) -> list[dict[str, Any]]:
    answer = client.get(f"/v1/jobs/{job}/log")
    assert answer.status_code == 200, answer.text
    return answer.json()["entries"]


def test_a_log_has_the_submission_the_start_each_pass_and_the_end(
    client: httpx2.Client, server: RunningServer
) -> None:
    document = scene(40, 24) | {"name": "reported afterwards"}
    with Client(server.url) as ours:
        job = ours.submit(document, quality={"mode": "target", "error": 0.02}).wait()
        passes = job.convergence().passes
        assert [entry.event for entry in job.log().entries if entry.event == "pass_finished"]
    entries = log_of(client, job.id)
    events = [entry["event"] for entry in entries]
    assert events[:2] == ["submitted", "started"]
    assert events[2:] == ["pass_finished"] * len(passes) + ["succeeded"]
    assert [entry["pass_index"] for entry in entries[2:-1]] == list(range(len(passes)))
    times = [datetime.fromisoformat(entry["at"]) for entry in entries]
    assert times == sorted(times)
    assert [times[0], times[1], times[-1]] == [job.created_at, job.started_at, job.finished_at]
    assert "40 x 24" in entries[0]["message"]


def test_a_shared_render_is_logged_without_the_times_of_other_users(
    server: RunningServer,
) -> None:
    document = scene(24, 16) | {"background": [0.3, 0.2, 0.1]}
    with Client(server.url) as client:
        first, second = (client.submit(document).wait().log() for _ in range(2))
    assert [entry.event for entry in second.entries][:2] == ["submitted", "shared"]
    before, after = (
        [entry for entry in log.entries if entry.event == "pass_finished"] for log in (first, second)
    )
    assert [entry.message for entry in after] == [entry.message for entry in before]
    assert all(entry.at is not None for entry in before)
    assert {entry.at for entry in after} == {None}


def test_a_failure_is_reported_with_its_reason(client: httpx2.Client) -> None:
    content = FILES["ply binary"]()[:2900]
    put(client, content)
    job = client.post("/v1/jobs", json={"scene": with_mesh(content)}).json()["id"]
    failure = wait(client, job, lambda found: found["state"] == "failed")["failure"]
    last = log_of(client, job)[-1]
    assert last["event"] == "failed"
    assert failure["message"] in last["message"]


def test_a_cancelled_job_says_so(client: httpx2.Client) -> None:
    job = client.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
    client.post(f"/v1/jobs/{job}/cancel")
    assert log_of(client, job)[-1]["event"] == "cancelled"
    assert client.get("/v1/jobs/none/log").status_code == 404


@pytest.mark.slow
def test_a_worker_that_died_is_reported_with_the_tile_that_it_had(start: Start) -> None:
    server = start(workers=1, tile_size=64)
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        job = client.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
        wait(client, job, lambda found: found["progress"]["done"] >= 2)
        (worker,) = workers_of(server.process.pid)
        kill_at_work(worker)

        def lost() -> list[dict[str, Any]]:
            return [entry for entry in log_of(client, job) if entry.get("workers_lost")]

        until(lambda: bool(lost()))
        (entry,) = lost()
        assert entry["event"] == "step_repeated"
        assert entry["workers_lost"] == 1
        assert f"Tile {entry['tile']} of pass {entry['pass_index']}" in entry["message"]
        client.delete(f"/v1/jobs/{job}")
