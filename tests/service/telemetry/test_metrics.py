"""Metrics, read as Prometheus reads them."""

import httpx2
import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.service.conftest import Start
from tests.service.processes import workers_of
from tests.service.sending import DAMAGED, put, with_mesh
from tests.service.support import (
    API_ON_BOTH,
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


def metrics(client: httpx2.Client) -> Samples:
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
    """Number of jobs that wait or run."""
    return samples["penumbra_jobs", "queued"] + samples["penumbra_jobs", "running"]


def retries(samples: Samples) -> dict[str, float]:
    """Retries of tasks by cause."""
    return {
        name[1]: value for name, value in samples.items() if name[0] == "penumbra_retries_total" and value
    }


@API_ON_BOTH
def test_tiles_and_cpu_seconds_of_a_job_are_counted(api: httpx2.Client) -> None:
    until(lambda: unfinished(metrics(api)) == 0)  # other tests may have left theirs
    before = metrics(api)
    job = finish(api, submit(api, scene()))
    after = metrics(api)
    # Each finished tile is an event of the job, in each of its passes.
    assert after["penumbra_tiles_total",] - before["penumbra_tiles_total",] == job["last_seq"]
    user = ("penumbra_user_cpu_seconds_total", job["user"])
    # The CPU seconds of a picture are those of its tiles; composing it is counted besides. Sums round.
    assert after[user] >= (before.get(user, 0) + job["cost"]["cpu_seconds"]) * (1 - 2**-50)
    assert after["process_resident_memory_bytes",] > 0


def test_errors_over_targets_and_failures_are_counted(api: httpx2.Client) -> None:
    finish(api, submit(api, scene(), quality={"mode": "target", "error": 0.05}))
    put(api, DAMAGED)
    failure = wait(api, submit(api, with_mesh(DAMAGED)), ended)["failure"]
    samples = metrics(api)
    assert samples["penumbra_error_over_target", "0.5"] > 0
    assert samples["penumbra_failed_jobs", failure["code"]] >= 1


@pytest.mark.slow
def test_queue_retries_and_dead_workers_are_counted(start: Start) -> None:
    server = start(workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        assert metrics(client)["penumbra_jobs", "queued"] == 0
        jobs = [submit(client, scene(256, 256, samples=256, light_samples=64)) for _ in range(3)]
        assert unfinished(metrics(client)) == len(jobs)
        assert retries(metrics(client)) == {}
        until(lambda: any(job_of(client, job)["progress"]["done"] >= 2 for job in jobs))
        kill_at_work(workers_of(server.process.pid)[0])
        until(lambda: bool(retries(metrics(client))))
        # The task that waited behind the tile in the worker is taken back, too.
        assert {"worker_died": 1}.items() <= retries(metrics(client)).items()
        assert retries(metrics(client)).keys() <= {"worker_died", "interrupted"}
        assert metrics(client)["penumbra_worker_deaths_total",] == 1
        for job in jobs:
            client.post(f"/v1/jobs/{job}/cancel")
            wait(client, job, ended)
        assert unfinished(metrics(client)) == 0
