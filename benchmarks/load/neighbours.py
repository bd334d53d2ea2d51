"""One user's three hundred jobs beside another user's one."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.bursts import LONGEST, keys_for, scene
from benchmarks.load.promises import Promise, promise
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ALLOWED = 2
THREADS = 4


def measure(many: int = 300, visits: int = 5) -> Iterator[Promise]:
    """Count the tiles of the one that are finished between another's submission and its first tile."""
    with TemporaryDirectory() as folder:
        settings = Settings(data=Path(folder) / "data", port=0, workers=1, log_level="debug")
        busy, *visitors = keys_for(settings, 1 + visits).values()
        log = Path(folder) / "log"
        with log.open("wb") as stderr, running(settings, stderr=stderr) as server:
            own, visited, left = _visited(server.url, busy, visitors, many)
        between = tiles_between([json.loads(line) for line in log.read_text().splitlines()], visited, own)
    yield promise(
        f"One user's {many} jobs do not delay another's single job by more than {ALLOWED} tiles "
        "for each worker.",
        f"{max(between)} tiles before the first of another user, at most, in {visits} visits",
        held=max(between) <= ALLOWED and left > 0,
        limit=f"{ALLOWED} tiles",
        between=between,
        jobs_left_after_the_visits=left,
        workers=1,
    )


def tiles_between(lines: Sequence[dict[str, Any]], jobs: Sequence[str], crowd: Sequence[str]) -> list[int]:
    """Count, for each of these jobs, the tiles of a crowd from when it was taken to its first tile.

    Examples
    --------
    >>> taken, own = {"event": "job taken", "job": "b"}, {"event": "task done", "tile": 0, "job": "b"}
    >>> tiles_between([own | {"job": "a"}, taken, own | {"job": "a"}, own], ["b"], ["a"])
    [1]
    """
    found = []
    for job in jobs:
        taken = next(n for n, line in enumerate(lines) if line["event"] == "job taken" and line["job"] == job)
        done = [line["job"] for line in lines[taken:] if line["event"] == "task done" and "tile" in line]
        found.append(sum(other in crowd for other in done[: done.index(job)]))
    return found


def _visited(url: str, busy: str, visitors: Sequence[str], many: int) -> tuple[list[str], list[str], int]:
    """Give the jobs of the one, those of the visitors, and how many of the first were left at the end."""
    with _client(url, busy) as client, ThreadPoolExecutor(THREADS) as pool:
        own = list(pool.map(lambda number: _submitted(client, scene(number)), range(many)))
        visited = [_visit(url, key, many + number) for number, key in enumerate(visitors)]
        left = sum(client.get(f"/v1/jobs/{job}").json()["finished_at"] is None for job in own)
        for job in own:
            client.delete(f"/v1/jobs/{job}")
    return own, visited, left


def _visit(url: str, key: str, number: int) -> str:
    """Render one job to its end; each visitor comes but once, and owes nothing."""
    with _client(url, key) as client:
        return _submitted(client, scene(number), wait=60)


def _submitted(client: httpx2.Client, document: dict[str, Any], *, wait: int = 0) -> str:
    answer = client.post("/v1/jobs", json={"scene": document}, headers={"Prefer": f"wait={wait}"})
    answer.raise_for_status()
    job: str = answer.json()["id"]
    return job


def _client(url: str, key: str) -> httpx2.Client:
    return httpx2.Client(base_url=url, timeout=LONGEST, headers={"Authorization": f"Bearer {key}"})
