"""Threads of a service after an error that nobody has foreseen: they go on, or the service ends."""

import hashlib
import os
import resource
import signal
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import httpx2
import numpy as np
import pytest

from service.settings import Settings
from tests.service.conftest import Start
from tests.service.failover import half_done
from tests.service.forking import running
from tests.service.processes import workers_of
from tests.service.support import TIMEOUT, finish, image, job_of, scene, submit, until

pytestmark = pytest.mark.slow

MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
BEGUN = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")
MANY_FILES = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
ASSET = f"assets/{hashlib.sha256(MESH).hexdigest()}"


def change(data: Path, statement: str) -> None:
    with closing(sqlite3.connect(data / "penumbra.sqlite", timeout=TIMEOUT)) as connection:
        connection.execute(statement)
        connection.commit()


def detail(client: httpx2.Client) -> str:
    """Reasons why a service is not ready."""
    answer = client.get("/readyz")
    return "" if answer.status_code == 200 else answer.json()["detail"]


def test_retention_goes_on_after_an_error_of_the_file_system(start: Start, tmp_path: Path) -> None:
    server = start(workers=1, keep_seconds=1.0, keep_asset_seconds=1.0)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        client.put(f"/v1/{ASSET}", content=MESH).raise_for_status()
        # A folder is not deleted as files are: EISDIR, for root as well.
        (tmp_path / ASSET).unlink()
        (tmp_path / ASSET).mkdir()
        os.utime(tmp_path / ASSET, (0, 0))
        until(lambda: client.head(f"/v1/{ASSET}").status_code == 404)
        job = submit(client, scene(16, 16))
        until(lambda: job_of(client, job).get("state") not in {"queued", "running", "succeeded"})


def test_service_that_cannot_delete_is_not_ready(start: Start, tmp_path: Path) -> None:
    server = start(workers=1, keep_seconds=1.0)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        change(tmp_path, "ALTER TABLE idempotency_keys RENAME TO away")
        until(lambda: "deleted" in detail(client))
        change(tmp_path, "ALTER TABLE away RENAME TO idempotency_keys")
        until(lambda: not detail(client))


def test_worker_is_replaced_after_too_many_open_files(tmp_path: Path) -> None:
    log = tmp_path / "log"
    settings = Settings(data=tmp_path / "data", port=0, workers=1, log_level="error")
    with log.open("wb") as stderr, running(settings, stderr=stderr) as server:
        (worker,) = workers_of(server.process.pid)
        usual = resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (1, MANY_FILES))
        os.kill(worker, signal.SIGKILL)
        until(lambda: '"thread": "slot"' in log.read_text())
        resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (usual[0], MANY_FILES))
        with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            finish(client, submit(client, scene(16, 16)))


@pytest.mark.parametrize("killed", [False, True], ids=["at_work", "at_the_start"])
def test_job_that_cannot_be_read_ends_no_other(start: Start, tmp_path: Path, killed: bool) -> None:
    server = start(workers=1, tile_size=48)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job, other = half_done(client), submit(client, scene(16, 16))
    if killed:
        server.process.kill()
        server.process.wait()
    change(tmp_path, f"UPDATE renders SET started_at = 'yesterday' WHERE id = '{job}'")  # noqa: S608
    server = start(workers=1, tile_size=48) if killed else server
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        finish(client, other)
        until(lambda: job_of(client, job)["state"] == "failed")
        assert job_of(client, job)["damage"]


@pytest.mark.parametrize("repaired", [True, False], ids=["goes_on", "ends"])
def test_dispatcher_after_an_error_it_does_not_know(
    tmp_path: Path, undisturbed: np.ndarray, repaired: bool
) -> None:
    data, log = tmp_path / "data", tmp_path / "log"
    settings = Settings(data=data, port=0, workers=1, tile_size=48, log_level="error")

    def enter(begun: str) -> None:
        change(data, f"UPDATE leader SET expires_at = '{begun}'")  # noqa: S608  (our own)

    def check(client: httpx2.Client, job: str) -> None:
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()

    with (
        log.open("wb") as stderr,
        running(settings, stderr=stderr) as server,
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
    ):
        job = half_done(client)
        enter("yesterday")
        until(lambda: '"thread": "dispatcher"' in log.read_text())
        assert '"ValueError"' in log.read_text()
        if repaired:
            enter(BEGUN)
            check(client, job)
            assert not detail(client)
        else:
            assert server.process.wait(TIMEOUT) == os.EX_SOFTWARE
    if not repaired:
        enter(BEGUN)
        with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            check(client, job)
