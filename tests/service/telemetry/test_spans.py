"""Spans of requests, jobs and tiles, as a collector receives them."""

import json
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import httpx2
import pytest

from service.server import RunningServer
from service.settings import Settings
from tests.service.collector import Collector, collecting
from tests.service.forking import running
from tests.service.processes import held, workers_of
from tests.service.support import TIMEOUT, ended, finish, job_of, kill_at_work, scene, submit, until, wait

TRACE, ASKER = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
TRACED = {"traceparent": f"00-{TRACE}-{ASKER}-01", "X-Request-ID": "traced"}
ENDPOINT = "OTEL_EXPORTER_OTLP_ENDPOINT"


class Traced(NamedTuple):
    """A server, a client of it, and where its spans go."""

    server: RunningServer
    client: httpx2.Client
    collector: Collector


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Traced]:
    settings = Settings(
        data=tmp_path_factory.mktemp("traced"), port=0, workers=1, tile_size=32, log_level="error"
    )
    with pytest.MonkeyPatch.context() as environment, collecting() as collector:
        environment.setenv(ENDPOINT, collector.url)
        environment.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
        with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            yield Traced(server, client, collector)


def slow_scene() -> dict[str, Any]:
    """A few tiles of many passes: it takes ten seconds to render."""
    return scene(64, 64, samples=1024, light_samples=256)


def test_job_is_a_trace_from_its_request_to_every_tile(traced: Traced) -> None:
    client, collector = traced.client, traced.collector
    answer = client.post("/v1/jobs", json={"scene": scene()}, headers=TRACED)
    job = finish(client, answer.json()["id"])
    shared = client.post("/v1/jobs", json={"scene": scene()}).json()["id"]
    until(lambda: bool(collector.spans("job", job=job["id"])))

    (request,) = collector.spans("POST /v1/jobs", request="traced", job=job["id"])
    assert (request.trace, request.parent, request.links) == (TRACE, ASKER, ())
    assert request.attributes["http.response.status_code"] == 202
    assert request.resource["service.name"] == "penumbra"

    (whole,) = collector.spans("job", job=job["id"])
    assert (whole.trace, whole.parent, whole.id) == (TRACE, request.id, job["id"])
    assert (whole.attributes["penumbra.state"], whole.failed) == ("succeeded", None)

    events = client.get(f"/v1/jobs/{job['id']}/tiles").json()["events"]
    tiles = collector.spans("tile", job=job["id"], attempt=1, outcome="TileDone")
    places = [(span.attributes["penumbra.tile"], span.attributes["penumbra.pass_index"]) for span in tiles]
    assert sorted(places) == sorted((event["tile"], event["pass_index"]) for event in events)
    cost = sum(float(span.attributes["penumbra.cpu_seconds"]) for span in tiles)
    assert cost == pytest.approx(job["cost"]["cpu_seconds"], rel=1e-9)
    (compose,) = collector.spans("compose", job=job["id"])
    for span in (*tiles, compose):
        assert (span.trace, span.parent, span.failed) == (TRACE, whole.id, None)
        assert whole.begun <= span.begun <= span.ended

    # A request whose picture is shared is linked to the job that it was made for.
    until(lambda: bool(collector.spans("POST /v1/jobs", job=shared)))
    assert collector.spans("POST /v1/jobs", job=shared)[0].links == (job["id"],)


def test_probes_and_metrics_have_no_span(traced: Traced) -> None:
    _, client, collector = traced
    paths = ["/livez", "/readyz", "/metrics", "/version"]
    assert all(client.get(path).status_code in (200, 503) for path in paths)
    until(lambda: "GET /version" in collector.names())
    assert not {f"GET {path}" for path in paths[:-1]} & collector.names()


@pytest.mark.slow
def test_lost_worker_is_in_the_spans_and_in_the_log_of_its_job(traced: Traced) -> None:
    server, client, collector = traced
    job = submit(client, slow_scene())
    wait(client, job, lambda found: found["progress"]["done"] >= 2)
    kill_at_work(workers_of(server.process.pid)[0])
    until(lambda: bool(collector.spans("tile", job=job, outcome="WorkerDied")))
    (lost,) = collector.spans("tile", job=job, outcome="WorkerDied")
    assert (lost.failed, lost.attributes["penumbra.attempt"]) == ("worker_died", 1)

    def told() -> list[dict[str, Any]]:
        entries = client.get(f"/v1/jobs/{job}/log").json()["entries"]
        return [entry for entry in entries if entry.get("workers_lost")]

    until(lambda: bool(told()))
    (entry,) = told()
    assert (entry["event"], entry["workers_lost"]) == ("step_repeated", 1)
    assert entry["tile"] == lost.attributes["penumbra.tile"]
    client.post(f"/v1/jobs/{job}/cancel")
    wait(client, job, ended)
    until(lambda: bool(collector.spans("job", job=job, state="cancelled")))


def test_job_that_is_cancelled_before_it_begins_has_a_span(traced: Traced) -> None:
    server, client, collector = traced
    busy = submit(client, slow_scene())
    wait(client, busy, lambda found: found["progress"]["done"] >= 1)
    (worker,) = workers_of(server.process.pid)
    with held(worker):
        waiting = submit(client, slow_scene())
        client.post(f"/v1/jobs/{waiting}/cancel")
        assert job_of(client, waiting)["started_at"] is None
        until(lambda: bool(collector.spans("job", job=waiting, state="cancelled")))
    client.delete(f"/v1/jobs/{busy}")


@pytest.mark.slow
def test_collector_that_is_away_costs_a_line_of_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket() as closed:
        # Bound but not listening, so that connections are refused.
        closed.bind(("127.0.0.1", 0))
        monkeypatch.setenv(ENDPOINT, f"http://127.0.0.1:{closed.getsockname()[1]}")
        monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_TIMEOUT", "0.5")
        log = tmp_path / "log"

        def warnings() -> list[str]:
            lines = [json.loads(line) for line in log.read_text().splitlines()]
            # A request before the worker has started is answered so, and that is logged, too.
            return [line["event"] for line in lines if line["level"] != "info" and line["event"] != "request"]

        with (
            log.open("wb") as stderr,
            running(Settings(data=tmp_path, port=0, workers=1), stderr=stderr) as server,
            httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
        ):
            finish(client, submit(client, scene(24, 24)))
            until(lambda: bool(warnings()))
            finish(client, submit(client, scene(24, 24)))
    # It has ended by itself, and was not killed.
    assert server.process.returncode == -signal.SIGTERM
    assert len(warnings()) == 1
