"""A backup made and restored by the commands of docs/how-to/backup.md serves every job."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import httpx2
import pytest

from service.server import running
from service.settings import Settings
from tests.pages import blocks, page
from tests.postgres_server import programs
from tests.service.support import TIMEOUT, finish, job_of, long_scene, scene, wait
from tests.service.test_assets import png, put, textured

DAY = "2026-11-23"
"""The day of the backup that the page restores."""


def commands(section: str) -> tuple[str, str]:
    """What a section of the page runs to back up, and to restore."""
    (text,) = re.findall(rf"^## {section}\n(.*?)^## ", page("how-to/backup.md"), re.MULTILINE | re.DOTALL)
    backup, restore = blocks(text, "sh")
    return backup.replace("$(date +%F)", DAY), restore


def execute(script: str, folder: Path, database: str | None) -> None:
    """Run commands of the page, with a folder as the root of the paths that they name."""
    for place in ("/srv/", "/backup/"):
        script = script.replace(place, f"{folder}{place}")
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    if shutil.which("rsync") is None:
        copier = Path(__file__).with_name("rsync.py")
        (tools / "rsync").write_text(f'#!/bin/sh\nexec "{sys.executable}" "{copier}" "$@"\n')
        (tools / "rsync").chmod(0o755)
    path = f"{tools}:{programs()}:{os.environ['PATH']}"
    # The service takes the name of a driver in an address, PostgreSQL's own programs do not.
    named = {"PENUMBRA_DATABASE": database.replace("+psycopg", "")} if database else {}
    ended = subprocess.run(
        ["sh", "-euc", script],
        env=os.environ | {"PATH": path} | named,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["SQLite", "PostgreSQL"])
def test_a_backup_made_while_jobs_run_serves_every_job_after_a_restore(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if kind == "SQLite" and shutil.which("sqlite3") is None:
        pytest.skip("the page uses sqlite3")
    postgres = request.getfixturevalue("postgres") if kind == "PostgreSQL" else None
    old, new = (postgres.database(), postgres.database()) if postgres else (None, None)
    backup, restore = commands(kind)
    settings = Settings(
        data=tmp_path / "srv" / "penumbra", port=0, workers=1, log_level="error", database=old
    )
    content = png(5, 4)
    digest = hashlib.sha256(content).hexdigest()
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        put(client, content)
        documents = [scene(32, 32, samples=1, light_samples=1), textured(f"sha256:{digest}")]
        jobs = [client.post("/v1/jobs", json={"scene": document}).json()["id"] for document in documents]
        for job in jobs:
            finish(client, job)
        under_way = client.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
        wait(client, under_way, lambda job: job["progress"]["done"] >= 3)
        execute(backup, tmp_path, old)
        assert job_of(client, under_way)["state"] == "running"
        before = [client.get(f"/v1/jobs/{job}/image.npy").content for job in jobs]
        finish(client, under_way)
        before.append(client.get(f"/v1/jobs/{under_way}/image.npy").content)
    execute(restore, tmp_path, new)
    restored = settings.model_copy(update={"database": new})
    with running(restored) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        listed = {job["id"]: job["state"] for job in client.get("/v1/jobs").json()["jobs"]}
        assert set(listed) == {*jobs, under_way}
        # Unfinished jobs continue from their finished tiles, to the same picture.
        assert job_of(client, under_way)["progress"]["done"] >= 3
        finish(client, under_way)
        assert [client.get(f"/v1/jobs/{job}/image.npy").content for job in (*jobs, under_way)] == before
        assert client.get(f"/v1/assets/{digest}").content == content
