"""Tests specific to a service on PostgreSQL."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import httpx2
import psutil
import pytest

import renderer
from service.errors import DatabaseUrlError, StoreTakenError
from service.storage.database.connection import Database
from service.storage.ownership import held
from tests.postgres_server import LEASH, PostgresServer
from tests.service.conftest import Start
from tests.service.support import (
    TIMEOUT,
    finish,
    image,
    long_scene,
    submit,
    until,
    wait,
)


@pytest.mark.slow
def test_a_killed_server_resumes_and_reports_no_finished_tile_again(
    start: Start, postgres: PostgresServer
) -> None:
    url = postgres.database()
    first = start(tile_size=64, database=url)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["progress"]["done"] >= 6)
    first.process.kill()
    first.process.wait()
    with httpx2.Client(base_url=start(tile_size=64, database=url).url, timeout=TIMEOUT) as client:
        done = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        assert len(done) >= 6
        finish(client, job)
        assert client.get(f"/v1/jobs/{job}/tiles").json()["events"][: len(done)] == done
        undisturbed = renderer.render(renderer.compile_scene(long_scene()), workers=2).image
        assert image(client, job).tobytes() == undisturbed.tobytes()


def test_servers_share_a_folder_only_where_they_share_a_database(tmp_path: Path) -> None:
    with held(tmp_path, shared=True):
        with held(tmp_path, shared=True):
            pass
        with pytest.raises(StoreTakenError, match="services on PostgreSQL"), held(tmp_path, shared=False):
            pass


@pytest.mark.parametrize(
    ("url", "cure"),
    [
        ("mysql://localhost/penumbra", "postgresql://user@host/name"),
        ("postgresql+psycopg2://localhost/penumbra", "postgresql://user@host/name"),
        ("penumbra.sqlite", "sqlite:///file"),
    ],
)
def test_an_address_that_cannot_be_used_is_refused_with_one_that_can(url: str, cure: str) -> None:
    with pytest.raises(DatabaseUrlError, match=cure):
        Database(url)


@pytest.mark.skipif(not LEASH, reason="only Linux, with the program setpriv, ends what a process has started")
@pytest.mark.usefixtures("postgres")
def test_a_test_run_that_is_killed_leaves_no_database_server_behind() -> None:
    script = (
        "import tests.postgres_server as here; print(here.PostgresServer(here.programs()).folder); input()"
    )
    words = [sys.executable, "-u", "-c", script]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        folder = Path(run.stdout.readline().strip())
        server = psutil.Process(int((folder / "data" / "postmaster.pid").read_text().split()[0]))
        run.kill()
    until(lambda: not server.is_running() or server.status() == psutil.STATUS_ZOMBIE)
    shutil.rmtree(folder)
