"""What all faults need: a service of their own, jobs, and what its database holds."""

from __future__ import annotations

import sqlite3
import time
from contextlib import closing
from typing import TYPE_CHECKING, Any

from benchmarks.bursts import scene
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import httpx2

# Nothing that is waited for takes longer, seconds; what does counts as hung.
LONGEST = 300.0


def settings(data: Path, **changes: Any) -> Settings:
    """Settings of a service with two workers that says little."""
    chosen: dict[str, Any] = {"data": data, "port": 0, "workers": 2, "tile_size": 32, "log_level": "error"}
    return Settings(**(chosen | changes))


def picture(number: int, name: str = "chaos", samples: int = 36) -> dict[str, Any]:
    """Give a picture of a dozen steps, each number from a place of its own."""
    document = scene(number)
    sampling = {
        "antialiasing": {"pattern": "uniform", "samples": samples},
        "light": {"pattern": "uniform", "samples": 36},
        "seed": number,
    }
    return document | {"name": name, "sampling": sampling}


def submit(client: httpx2.Client, document: dict[str, Any]) -> str:
    """Send a job and give its id."""
    answer = client.post("/v1/jobs", json={"scene": document}, headers={"Cache-Control": "no-cache"})
    answer.raise_for_status()
    return str(answer.json()["id"])


def ended(client: httpx2.Client, job: str) -> dict[str, Any]:
    """Wait until a job has ended."""
    deadline = time.monotonic() + LONGEST
    while time.monotonic() < deadline:
        client.get(f"/v1/jobs/{job}/tiles", params={"after": 2**30, "wait": 5})
        found: dict[str, Any] = client.get(f"/v1/jobs/{job}").json()
        if found["finished_at"]:
            return found
    return {"id": job, "state": "hung"}


def image(client: httpx2.Client, job: str) -> bytes:
    """Give the bytes of a picture."""
    return bytes(client.get(f"/v1/jobs/{job}/image.npy").content)


def until(condition: Callable[[], bool], seconds: float = LONGEST) -> bool:
    """Wait for something; False if it does not happen in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def steps(data: Path) -> dict[tuple[int, int, int], tuple[Any, ...]]:
    """Give state, attempt, deaths and checksum of all steps in a data folder, by render, pass and tile."""
    query = "SELECT render, pass_index, tile, state, attempt, deaths, crc32 FROM tiles"
    with closing(sqlite3.connect(data / "penumbra.sqlite")) as connection:
        return {tuple(row[:3]): tuple(row[3:]) for row in connection.execute(query)}
