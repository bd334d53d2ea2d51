"""A backup of a running service, as docs/how-to/operations.md makes it, serves jobs from another folder."""

from __future__ import annotations

import hashlib
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import httpx2
import pytest

from service.server import running
from service.settings import Settings
from tests.integration.conftest import Start
from tests.integration.support import TIMEOUT, finish, job_of, long_scene, scene, wait
from tests.integration.test_assets import png, put, textured


def copy_files(data: Path, backup: Path) -> None:
    """What `rsync -a` does: files that others write meanwhile may come and go."""
    for path in [found for name in ("jobs", "assets") for found in (data / name).rglob("*")]:
        target = backup / path.relative_to(data)
        try:
            if path.is_file() and not path.name.startswith("."):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(path, target)
        except FileNotFoundError:
            continue


def back_up(data: Path, backup: Path) -> None:
    """Files, the database, and the files again that were written in between."""
    backup.mkdir()
    copy_files(data, backup)
    with closing(sqlite3.connect(data / "penumbra.sqlite")) as connection:
        connection.execute("VACUUM INTO ?", (str(backup / "penumbra.sqlite"),))
    copy_files(data, backup)


@pytest.mark.slow
def test_a_backup_made_while_jobs_run_serves_every_job_elsewhere(start: Start, tmp_path: Path) -> None:
    server, backup = start(workers=1), tmp_path / "backup"
    content = png(5, 4)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        put(client, content)
        textured_scene = textured(f"sha256:{hashlib.sha256(content).hexdigest()}")
        documents = [scene(32, 32, samples=1, light_samples=1), textured_scene]
        jobs = [client.post("/v1/jobs", json={"scene": document}).json()["id"] for document in documents]
        for job in jobs:
            finish(client, job)
        under_way = client.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
        wait(client, under_way, lambda job: job["progress"]["done"] >= 3)
        back_up(server.data, backup)
        assert job_of(client, under_way)["state"] == "running"
        before = [client.get(f"/v1/jobs/{job}/image.npy").content for job in jobs]
        finish(client, under_way)
        before.append(client.get(f"/v1/jobs/{under_way}/image.npy").content)
    server.stop()
    settings = Settings(data=backup, port=0, workers=1, log_level="error")
    with running(settings) as restored, httpx2.Client(base_url=restored.url, timeout=TIMEOUT) as client:
        listed = {job["id"]: job["state"] for job in client.get("/v1/jobs").json()["jobs"]}
        assert set(listed) == {*jobs, under_way}
        # Unfinished jobs continue from their finished tiles, to the same picture.
        assert job_of(client, under_way)["progress"]["done"] >= 3
        finish(client, under_way)
        assert [client.get(f"/v1/jobs/{job}/image.npy").content for job in (*jobs, under_way)] == before
        assert client.get(f"/v1/assets/{hashlib.sha256(content).hexdigest()}").content == content
