"""The history of a job, derived from its rows."""

from datetime import datetime
from typing import Any

import httpx2

from tests.service.sending import DAMAGED, put, with_mesh
from tests.service.support import ended, finish, scene, submit, wait


def log_of(client: httpx2.Client, job: str) -> list[dict[str, Any]]:
    answer = client.get(f"/v1/jobs/{job}/log")
    assert answer.status_code == 200, answer.text
    return answer.json()["entries"]


def test_log_has_the_submission_the_start_each_pass_and_the_end(api: httpx2.Client) -> None:
    sent = submit(api, scene(40, 24), quality={"mode": "target", "error": 0.02})
    job = finish(api, sent)
    passes = api.get(f"/v1/jobs/{sent}/convergence").json()["passes"]
    entries = log_of(api, sent)
    events = [entry["event"] for entry in entries]
    assert events == ["submitted", "started", *["pass_finished"] * len(passes), "succeeded"]
    assert [entry["pass_index"] for entry in entries[2:-1]] == list(range(len(passes)))
    times = [datetime.fromisoformat(entry["at"]) for entry in entries]
    assert times == sorted(times)
    stated = [datetime.fromisoformat(job[name]) for name in ("created_at", "started_at", "finished_at")]
    assert [times[0], times[1], times[-1]] == stated


def test_log_of_a_shared_render_hides_the_times_of_others(api: httpx2.Client) -> None:
    document = scene(24, 16) | {"background": [0.3, 0.2, 0.1]}
    first, second = (
        log_of(api, finish(api, api.post("/v1/jobs", json={"scene": document}).json()["id"])["id"])
        for _ in range(2)
    )
    assert [entry["event"] for entry in second][:2] == ["submitted", "shared"]
    before, after = ([entry for entry in log if entry["event"] == "pass_finished"] for log in (first, second))
    assert [entry["message"] for entry in after] == [entry["message"] for entry in before]
    assert all(entry["at"] is not None for entry in before)
    assert {entry["at"] for entry in after} == {None}


def test_log_ends_with_the_reason_of_a_failure(api: httpx2.Client) -> None:
    put(api, DAMAGED)
    job = submit(api, with_mesh(DAMAGED))
    failure = wait(api, job, ended)["failure"]
    last = log_of(api, job)[-1]
    assert last["event"] == "failed"
    assert failure["message"] in last["message"]
