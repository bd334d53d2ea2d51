"""Workers and servers that are killed in the middle of a job."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx2
import numpy as np
import pytest

import renderer
from benchmarks.load.processes import fork_servers_of, is_alive, workers_of
from service.errors import PortTakenError
from service.server import RunningServer, running
from service.settings import Settings
from tests.service.conftest import Start
from tests.service.support import (
    TIMEOUT,
    ended,
    finish,
    image,
    job_of,
    kill_at_work,
    long_scene,
    scene,
    steps,
    submit,
    until,
    wait,
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return renderer.render(renderer.compile_scene(long_scene()), workers=2).image


def connect(server: RunningServer) -> httpx2.Client:
    return httpx2.Client(base_url=server.url, timeout=TIMEOUT)


def test_a_tile_whose_worker_was_killed_is_rendered_again_and_no_other(
    start: Start, tmp_path: Path, undisturbed: np.ndarray
) -> None:
    server = start(tile_size=64)
    with connect(server) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        kill_at_work(workers_of(server.process.pid)[0])
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    deaths = [row["deaths"] for row in steps(tmp_path).values()]
    assert sum(deaths) <= 1
    again = [row for row in steps(tmp_path).values() if row["attempt"] > 1]
    # The one that ran, and the one that waited behind it in the same process.
    assert 1 <= len(again) <= 2
    assert len(workers_of(server.process.pid)) == 2


def test_a_worker_that_was_stopped_is_replaced_and_its_tile_rendered_again(
    start: Start, tmp_path: Path, undisturbed: np.ndarray
) -> None:
    server = start(tile_size=64, workers=1, worker_silence_seconds=1)
    with connect(server) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        (stopped,) = workers_of(server.process.pid)
        os.kill(stopped, signal.SIGSTOP)
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    assert not is_alive(stopped)
    assert sum(row["deaths"] for row in steps(tmp_path).values()) == 1


@pytest.mark.parametrize(
    ("name", "code", "retryable"),
    [
        ("poison", "worker_died", True),
        ("hungry", "out_of_memory", False),
        ("endless", "took_too_long", False),
    ],
)
def test_a_job_that_ruins_its_workers_fails_alone(
    ruined: httpx2.Client, name: str, code: str, retryable: bool
) -> None:
    small = scene(64, 48)
    job = submit(ruined, small | {"name": name})
    others = [submit(ruined, small) for _ in range(3)]
    found = wait(ruined, job, ended)
    assert (found["failure"]["code"], found["failure"]["retryable"]) == (code, retryable)
    assert ruined.get(f"/v1/jobs/{job}/image.png").status_code == 410
    for other in others:
        finish(ruined, other)


@pytest.fixture(scope="module")
def ruined(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    """A client of a service on which scenes of certain names kill their workers, or never end."""
    settings = Settings(
        data=tmp_path_factory.mktemp("ruined"),
        port=0,
        workers=2,
        log_level="error",
        max_attempts=2,
        max_task_seconds=2,
        worker_silence_seconds=2,
    )
    with running(settings, module="benchmarks.chaos.faulty") as server, connect(server) as client:
        yield client


def test_a_killed_server_resumes_and_renders_no_finished_tile_again(
    start: Start, tmp_path: Path, undisturbed: np.ndarray
) -> None:
    first = start(tile_size=64)
    with connect(first) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["progress"]["done"] >= 6)
    workers = workers_of(first.process.pid)
    first.process.kill()
    first.process.wait()
    until(lambda: not any(map(is_alive, workers)), seconds=1.0)
    finished = {key: row for key, row in steps(tmp_path).items() if row["state"] == "done"}
    assert len(finished) >= 6

    second = start(tile_size=64)
    with connect(second) as client:
        events = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        assert [event["seq"] for event in events[: len(finished)]] == list(range(1, len(finished) + 1))
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    after = steps(tmp_path)
    assert {key: after[key] for key in finished} == finished
    assert sorted(row["seq"] for row in after.values()) == list(range(1, len(after) + 1))


def test_a_killed_fork_server_is_replaced_and_costs_the_tiles_of_its_workers(
    start: Start, undisturbed: np.ndarray
) -> None:
    server = start(tile_size=64)
    with connect(server) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        (killed,), workers = fork_servers_of(server.process.pid), workers_of(server.process.pid)
        os.kill(killed, signal.SIGKILL)
        until(lambda: not any(map(is_alive, workers)))
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    assert len(workers_of(server.process.pid)) == 2


def test_a_fork_server_that_still_imports_dies_with_its_server(start: Start) -> None:
    server = start(workers=1)
    (first,) = fork_servers_of(server.process.pid)
    os.kill(first, signal.SIGKILL)
    until(lambda: not is_alive(first))
    until(lambda: any(map(is_importing, fork_servers_of(server.process.pid))))
    (second,) = (found for found in fork_servers_of(server.process.pid) if found != first)
    # As on a busy machine: its imports do not end meanwhile.
    os.kill(second, signal.SIGSTOP)
    try:
        server.process.kill()
        server.process.wait()
        until(lambda: not is_alive(second))
    finally:
        with suppress(ProcessLookupError):
            os.kill(second, signal.SIGKILL)


def is_importing(process: int) -> bool:
    with suppress(OSError):
        return "numpy" in Path(f"/proc/{process}/maps").read_text()
    return False


def test_what_a_killed_server_left_half_written_is_swept(start: Start, tmp_path: Path) -> None:
    first = start()
    first.process.kill()
    first.process.wait()
    litter = [tmp_path / "assets" / ".abc.tmp", tmp_path / "jobs" / "unknown" / "tiles" / "1-1.1"]
    for path in litter:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"half")
    start()
    assert not any(path.exists() for path in litter)


def test_a_second_server_on_the_same_folder_does_not_start(
    start: Start, capfd: pytest.CaptureFixture[str]
) -> None:
    start()
    with pytest.raises(Exception, match="ended with code"):
        start()
    assert "Another service uses" in capfd.readouterr().err


def test_a_stopped_server_sends_its_watchers_away_and_resumes_later(start: Start) -> None:
    first = start(workers=1)
    with connect(first) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["last_seq"] > 0)
        with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
            lines = answer.iter_lines()
            next(lines)
            first.process.terminate()
            assert not any(line == "event: end" for line in lines)
    assert first.process.wait(timeout=10) is not None
    with connect(start(workers=2)) as client:
        assert job_of(client, job)["state"] in {"running", "queued", "succeeded"}
        # The tasks of its workers are reported as retried.
        assert re.search(
            r'^penumbra_retries_total\{cause="server_lost"\} [1-9]', client.get("/metrics").text, re.MULTILINE
        )
        finish(client, job)


def test_a_service_does_not_start_at_a_port_where_another_one_listens(
    start: Start, tmp_path_factory: pytest.TempPathFactory
) -> None:
    port = httpx2.URL(start().url).port
    settings = Settings(data=tmp_path_factory.mktemp("second"), port=port, workers=1)
    with pytest.raises(PortTakenError, match=f"port {port}"), running(settings):
        pass
