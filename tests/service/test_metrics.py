"""Metrics, read as Prometheus reads them."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest
from prometheus_client.parser import text_string_to_metric_families

from benchmarks.load.processes import workers_of
from schemas.api.administration import Role
from service.access import keys
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.conftest import Start
from tests.service.support import (
    ON_BOTH,
    TIMEOUT,
    ended,
    finish,
    job_of,
    kill_at_work,
    scene,
    submit,
    until,
    wait,
)

Samples = dict[tuple[str, ...], float]
RETRIES = "penumbra_retries_total"


def watched(client: httpx2.Client) -> Samples:
    """Values of all samples by name and label values."""
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].startswith("text/plain")
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def unfinished(samples: Samples) -> float:
    """How many jobs wait or run."""
    return samples["penumbra_jobs", "queued"] + samples["penumbra_jobs", "running"]


def retries(samples: Samples) -> dict[str, float]:
    """How often tasks were tried again, by the cause."""
    return {name[1]: value for name, value in samples.items() if name[0] == RETRIES and value}


@ON_BOTH
def test_tiles_and_cpu_seconds_of_a_job_are_counted(client: httpx2.Client) -> None:
    until(lambda: unfinished(watched(client)) == 0)  # other tests may have left theirs
    before = watched(client)
    job = finish(client, submit(client, scene()))
    after = watched(client)
    tiles = after["penumbra_tiles_total",] - before["penumbra_tiles_total",]
    # Each finished tile is an event of the job, in each of its passes.
    assert tiles == job["last_seq"]
    user = ("penumbra_user_cpu_seconds_total", job["user"])
    # The CPU seconds of a picture are those of its tiles; composing it is counted besides. Sums round.
    assert after[user] >= (before.get(user, 0) + job["cost"]["cpu_seconds"]) * (1 - 2**-50)


@pytest.mark.slow
def test_the_queue_is_as_deep_as_the_jobs_that_wait_and_what_is_tried_again_is_counted(start: Start) -> None:
    server = start(workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        assert watched(client)["penumbra_jobs", "queued"] == 0
        jobs = [submit(client, scene(256, 256, samples=256, light_samples=64)) for _ in range(3)]
        samples = watched(client)
        assert unfinished(samples) == len(jobs)
        assert retries(samples) == {}
        until(lambda: any(job_of(client, job)["progress"]["done"] >= 2 for job in jobs))
        (worker,) = workers_of(server.process.pid)
        kill_at_work(worker)
        until(lambda: bool(retries(watched(client))))
        # The task that waited behind the tile in the worker is taken back, too.
        assert {"worker_died": 1}.items() <= retries(watched(client)).items()
        assert retries(watched(client)).keys() <= {"worker_died", "interrupted"}
        for job in jobs:
            client.post(f"/v1/jobs/{job}/cancel")
            wait(client, job, ended)
        assert unfinished(watched(client)) == 0


@pytest.mark.slow
def test_a_worker_that_dies_is_counted_and_the_job_that_fails_of_it_by_its_code(start: Start) -> None:
    server = start(workers=1, max_attempts=1, tile_size=64)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        # One tile, seconds of work in each pass.
        job = submit(client, scene(64, 64, samples=1024, light_samples=256))
        wait(client, job, lambda found: found["progress"]["done"] >= 1)
        kill_at_work(workers_of(server.process.pid)[0])
        failure = wait(client, job, ended)["failure"]
        samples = watched(client)
    assert samples["penumbra_worker_deaths_total",] == 1
    assert retries(samples) == {}
    assert samples["penumbra_failed_jobs", failure["code"]] == 1


@pytest.mark.slow
def test_reached_errors_are_reported_as_shares_of_their_targets(start: Start) -> None:
    with httpx2.Client(base_url=start().url, timeout=TIMEOUT) as client:
        assert ("penumbra_error_over_target", "0.5") not in watched(client)
        quality = {"mode": "target", "error": 0.05}
        job = finish(client, submit(client, scene(), quality=quality))
        reached = job["error"]["estimate"] / 0.05
        assert watched(client)["penumbra_error_over_target", "0.5"] == pytest.approx(reached, rel=1e-12)


def test_the_process_itself_is_measured(client: httpx2.Client) -> None:
    samples = watched(client)
    assert samples["process_resident_memory_bytes",] > 0
    assert samples["process_open_fds",] > 0


@pytest.mark.slow
def test_where_keys_are_asked_for_staff_alone_sees_the_numbers(start: Start, tmp_path: Path) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        made = {role: str(keys.add(session, role.value, role)) for role in Role}
    database.close()
    url = start(workers=1).url
    statuses = {
        role: httpx2.get(f"{url}/metrics", headers={"Authorization": f"Bearer {key}"}).status_code
        for role, key in made.items()
    }
    assert statuses == {Role.SUBMIT: 403, Role.STAFF: 200, Role.ADMIN: 200}
    assert httpx2.get(f"{url}/metrics").status_code == 401
