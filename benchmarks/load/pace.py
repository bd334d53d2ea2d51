"""How soon jobs are accepted and seen, and what the service adds to a render."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import httpx2

from benchmarks import overhead
from benchmarks.bursts import LONGEST, scene
from benchmarks.load.processes import cpu_seconds
from benchmarks.load.promises import Promise, promise
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator

THREADS = 4
LEAST_RATE = 20.0
MOST_RATIO = 1.05
MOST_FIRST = 0.5


def measure(jobs: int = 300, runs: int = 9) -> Iterator[Promise]:
    """Accept jobs as fast as they are sent; send a job of two seconds on every way."""
    yield from accepted(jobs)
    found = overhead.measure(runs)
    yield promise(
        "The service adds at most 5 % to a job of two seconds.",
        f"{100 * (found['ratio_to_call'] - 1):+.1f} % compared with rendering in process "
        f"(median of {runs} runs)",
        held=found["ratio_to_call"] <= MOST_RATIO,
        limit=f"{100 * (MOST_RATIO - 1):+.0f} %",
        **found,
    )
    first = found["first_pixels"]["median"]
    yield promise(
        "The first pixels of a job are there soon after it was sent.",
        f"{first:.3f} s (median of {runs})",
        held=first <= MOST_FIRST,
        limit=f"{MOST_FIRST:g} s",
        seconds=found["first_pixels"],
    )


def accepted(jobs: int) -> Iterator[Promise]:
    """Send jobs by several connections while one worker renders."""
    with TemporaryDirectory() as folder:
        settings = Settings(data=Path(folder), port=0, workers=1, log_level="error")
        with (
            running(settings) as server,
            httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
            ThreadPoolExecutor(THREADS) as pool,
        ):
            before, begun = cpu_seconds(server.process.pid), time.perf_counter()
            sent = pool.map(
                lambda number: client.post("/v1/jobs", json={"scene": scene(number)}), range(jobs)
            )
            taken = sum(answer.status_code == httpx2.codes.ACCEPTED for answer in sent)
            seconds = time.perf_counter() - begun
            cost = (cpu_seconds(server.process.pid) - before) / jobs
    yield promise(
        "Jobs are accepted faster than they are rendered.",
        f"{taken / seconds:.0f} a second, {1000 * cost:.1f} ms CPU of the service each",
        held=taken == jobs and taken / seconds >= LEAST_RATE,
        limit=f"{LEAST_RATE:g} a second",
        jobs=jobs,
        seconds=round(seconds, 3),
        connections=THREADS,
    )
