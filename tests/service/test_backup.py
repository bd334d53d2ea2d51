"""A backup made and restored by the commands of docs/how-to/backup.md serves every job."""

import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path

import httpx2
import pytest

from service.settings import Settings
from tests.pages import blocks, page
from tests.postgres_server import programs
from tests.service.forking import running
from tests.service.support import TIMEOUT, finish, job_of, long_scene, scene, submit, wait

DAY = "2026-11-23"
"""The day of the backup that the page restores."""
RSYNC = """#!/bin/sh
# rsync -a --exclude PATTERN SOURCE... TARGET
pattern=$3
shift 3
for target; do :; done
while [ $# -gt 1 ]; do
  tar -C "$(dirname "$1")" --exclude="$pattern" --ignore-failed-read --warning=no-file-changed \\
    -cf - "$(basename "$1")" | tar -C "$target" -xf - || exit 24
  shift
done
"""
"""A stand-in with the options that the page uses, for machines without rsync."""
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NAME = hashlib.sha256(MESH).hexdigest()


def commands(section: str) -> tuple[str, str]:
    """Commands of a section of the page for backup and restore."""
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
        (tools / "rsync").write_text(RSYNC)
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
def test_backup_made_while_jobs_run_serves_every_job(
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
    document = scene(32, 32, samples=1, light_samples=1)
    document["shapes"].append({"type": "mesh", "asset": f"sha256:{NAME}", "material": "ball"})
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        assert client.put(f"/v1/assets/{NAME}", content=MESH).status_code == 200
        done = client.post("/v1/jobs", json={"scene": document}).json()["id"]
        finish(client, done)
        under_way = submit(client, long_scene())
        wait(client, under_way, lambda job: job["progress"]["done"] >= 3)
        execute(backup, tmp_path, old)
        assert job_of(client, under_way)["state"] == "running"
        finish(client, under_way)
        before = [client.get(f"/v1/jobs/{job}/image.npy").content for job in (done, under_way)]
    execute(restore, tmp_path, new)
    restored = settings.model_copy(update={"database": new})
    with running(restored) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        assert {job["id"] for job in client.get("/v1/jobs").json()["jobs"]} == {done, under_way}
        # Unfinished jobs continue from their finished tiles, to the same picture.
        assert job_of(client, under_way)["progress"]["done"] >= 3
        finish(client, under_way)
        assert [client.get(f"/v1/jobs/{job}/image.npy").content for job in (done, under_way)] == before
        assert client.get(f"/v1/assets/{NAME}").content == MESH
