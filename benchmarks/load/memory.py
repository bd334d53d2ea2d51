"""Memory of the service and of its workers over many jobs."""

from __future__ import annotations

import statistics
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.bursts import LONGEST, scene
from benchmarks.load.processes import resident_bytes, workers_of
from benchmarks.load.promises import Promise, promise
from benchmarks.machine import describe
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SIDE = 16
THREADS = 8
STEP = 200
MOST_GROWTH = 10.0
"""Of any of the processes, per cent of its memory after the first jobs."""


def measure(jobs: int = 2000, step: int = STEP) -> Iterator[Promise]:
    """Render so many small pictures, and read the memory after every `step` of them."""
    with TemporaryDirectory() as folder:
        cores = describe()["cores"]
        settings = Settings(data=Path(folder), port=0, workers=cores, log_level="error")
        with (
            running(settings) as server,
            httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
            ThreadPoolExecutor(THREADS) as pool,
        ):
            taken: list[dict[str, int]] = []
            for first in range(0, jobs, step):
                states = pool.map(lambda number: _render(client, number), range(first, first + step))
                if set(states) != {"succeeded"}:
                    raise RuntimeError("Some of the jobs did not succeed.")
                taken.append(_memory(server.process.pid))
    growth = {name: 100 * (taken[-1][name] / taken[0][name] - 1) for name in taken[0]}
    slopes = {name: round(_slope([memory[name] for memory in taken], step), 1) for name in taken[0]}
    yield promise(
        f"Memory stays flat over {jobs:,} jobs.",
        ", ".join(f"{name} {taken[-1][name] / 2**20:.0f} MiB ({growth[name]:+.1f} %)" for name in taken[0]),
        held=max(growth.values()) <= MOST_GROWTH,
        limit=f"+{MOST_GROWTH:g} % after the first {step}",
        mib={name: [round(memory[name] / 2**20, 1) for memory in taken] for name in taken[0]},
        bytes_each_job=slopes,
    )


def _memory(server: int) -> dict[str, int]:
    workers = [resident_bytes(worker) for worker in workers_of(server)]
    return {"server": resident_bytes(server), "largest worker": max(workers)}


def _slope(values: Sequence[float], step: int) -> float:
    places = [step * (number + 1) for number in range(len(values))]
    return statistics.linear_regression(places, values).slope if len(values) > 1 else 0.0


def _render(client: httpx2.Client, number: int) -> str:
    document: dict[str, Any] = scene(number)
    document["camera"] |= {"width": SIDE, "height": SIDE}
    document["sampling"] = {"antialiasing": {"pattern": "center"}}
    answer = client.post("/v1/jobs", json={"scene": document}, headers={"Prefer": "wait=60"})
    answer.raise_for_status()
    state: str = answer.json()["state"]
    return state
