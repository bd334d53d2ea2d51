"""Small jobs, services to send them to, and the processes of a service."""

from __future__ import annotations

import json
import os
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.report import SCENES, Json
from renderer.processors import usable_processors
from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade

if TYPE_CHECKING:
    from collections.abc import Iterator

CORES = usable_processors()
LONGEST = 600.0
"""Seconds; a job that takes longer counts as hung."""


def settings(data: Path, **changes: Any) -> Settings:
    """Settings of a service on a free port that says little."""
    chosen: Json = {"data": data, "port": 0, "workers": 1, "log_level": "error"}
    return Settings(**(chosen | changes))


@contextmanager
def service(**changes: Any) -> Iterator[tuple[RunningServer, httpx2.Client]]:
    """A running service on an empty folder, and a client of it."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder), **changes)) as server,
        client(server.url) as own,
    ):
        yield server, own


def scene(number: int, side: int = 64, sampling: Json | None = None) -> Json:
    """A small picture of the basic scene, each number from a place of its own."""
    document: Json = json.loads((SCENES / "gallery" / "basic.json").read_text())
    camera = document["camera"]
    camera |= {"width": side, "height": side}
    camera["position"][0] += number / 1000
    return document | {"sampling": document.get("sampling", {}) | (sampling or {}) | {"seed": number}}


def client(url: str, key: str | None = None) -> httpx2.Client:
    """A client of a service, with the key of a user."""
    headers = {"Authorization": f"Bearer {key}"} if key else {}
    return httpx2.Client(base_url=url, timeout=LONGEST, headers=headers)


def submit(client: httpx2.Client, request: Json, wait: int = 0) -> Json:
    """Send a job, and give it as it is accepted, or after `wait` seconds."""
    headers = {"Cache-Control": "no-cache", "Prefer": f"wait={wait}"}
    answer = client.post("/v1/jobs", json=request, headers=headers)
    found: Json = answer.raise_for_status().json()
    return found


def ended(client: httpx2.Client, job: str) -> Json:
    """Wait until a job has ended."""
    deadline = time.monotonic() + LONGEST
    while time.monotonic() < deadline:
        client.get(f"/v1/jobs/{job}/tiles", params={"after": 2**30, "wait": 5})
        found: Json = client.get(f"/v1/jobs/{job}").json()
        if found["finished_at"]:
            return found
    return {"id": job, "state": "hung"}


def keys_for(settings: Settings, users: int) -> list[str]:
    """Make keys for so many users of a service that is to be started."""
    settings.data.mkdir(parents=True, exist_ok=True)
    database = Database(settings.database_url)
    upgrade(database)
    with database.writing() as session:
        secrets = [str(keys.add(session, f"user {number}", Role.SUBMIT)) for number in range(users)]
    database.close()
    return secrets


def cpu_seconds_of(process: int) -> float:
    """User and system time of all threads of a process, without its children."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mib(process: int) -> float:
    """Memory that a process has in use."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def workers_of(server: int) -> list[int]:
    """Process ids of the workers of a service: the children of what they are forked from."""
    return [worker for child in _children(server) if _is_fork_server(child) for worker in _children(child)]


def _children(process: int) -> Iterator[int]:
    with suppress(OSError):
        for thread in Path(f"/proc/{process}/task").iterdir():
            yield from map(int, (thread / "children").read_text().split())


def _is_fork_server(process: int) -> bool:
    with suppress(OSError):
        return b"spawn_main" in Path(f"/proc/{process}/cmdline").read_bytes()
    return False
