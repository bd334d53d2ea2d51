"""Workers that are killed, stopped or ruined by a scene in the middle of a job."""

import os
import signal
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from service.settings import Settings
from tests.service.conftest import Start
from tests.service.forking import running
from tests.service.processes import fork_servers_of, is_alive, workers_of
from tests.service.sending import client_of
from tests.service.support import ended, finish, image, kill_at_work, scene, steps, submit, until, wait, work


def test_tile_is_rendered_again(start: Start, tmp_path: Path, undisturbed: np.ndarray) -> None:
    server = start(tile_size=48)
    with client_of(server) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        kill_at_work(workers_of(server.process.pid)[0])
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    rows = steps(tmp_path).values()
    assert sum(row["deaths"] for row in rows) == 1
    # The one that ran, and the one that waited behind it in the same process.
    assert 1 <= sum(row["attempt"] > 1 for row in rows) <= 2
    until(lambda: len(workers_of(server.process.pid)) == 2)


@pytest.mark.slow
def test_scene_that_kills_its_workers_fails_alone(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path, port=0, workers=2, log_level="error", max_attempts=3)
    with (
        running(settings, module="tests.service.faulty") as server,
        client_of(server) as client,
    ):
        small = scene(64, 48)
        job, other = submit(client, small | {"name": "poison"}), submit(client, small)
        found = wait(client, job, ended)
        assert (found["failure"]["code"], found["failure"]["retryable"]) == ("worker_died", True)
        # The second attempt waits, and the third one longer.
        begun, ended_at = (datetime.fromisoformat(found[name]) for name in ("started_at", "finished_at"))
        assert (ended_at - begun).total_seconds() >= 0.5 + 2.0
        assert client.get(f"/v1/jobs/{job}/image.png").status_code == 410
        finish(client, other)


@pytest.mark.slow
def test_fork_server_that_still_imports_dies_with_its_server(start: Start) -> None:
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
