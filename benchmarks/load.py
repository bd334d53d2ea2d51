"""The service under load, each promise with a figure: `python -m benchmarks.load [PART ...]`."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

import renderer
from benchmarks.jobs import (
    LONGEST,
    Json,
    client,
    cpu_seconds_of,
    ended,
    keys_for,
    resident_mib,
    scene,
    settings,
    submit,
    workers_of,
)
from benchmarks.report import SCENES, Promise, conclude, promise
from service.client import Client
from service.server import RunningServer, running

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

CORES = len(os.sched_getaffinity(0))
PLAIN = {"antialiasing": {"pattern": "center", "samples": 1}}


def crowds(users: int = 30, jobs_each: int = 10) -> Iterator[Promise]:
    """All users send their jobs at once, to a queue with room for two thirds of them."""
    jobs = users * jobs_each
    with TemporaryDirectory() as folder:
        chosen = settings(Path(folder), workers=CORES, max_queued_jobs=2 * jobs // 3)
        secrets = keys_for(chosen, users)
        with running(chosen) as server, ThreadPoolExecutor(users) as pool:

            def all_of(place: int) -> tuple[int, float, int]:
                with client(server.url, secrets[place]) as own:
                    sent = [_insist(own, scene(place * jobs_each + number)) for number in range(jobs_each)]
                    found = [(ended(own, job), begun) for job, begun, _ in sent]
                lost = sum(job["state"] != "succeeded" for job, _ in found)
                finished = [datetime.fromisoformat(job["finished_at"]).timestamp() for job, _ in found]
                waits = [end - begun for end, (_, begun) in zip(finished, found, strict=True)]
                return lost, statistics.mean(waits), sum(refused for _, _, refused in sent)

            losses, waits, refusals = zip(*pool.map(all_of, range(users)), strict=True)
    lost, speeds = sum(losses), [1 / wait for wait in waits]
    yield promise(
        f"Of {jobs} jobs that {users} users send at once none is lost, refused ones included.",
        f"{jobs - lost} of {jobs} rendered, {sum(refusals)} refused and sent again",
        held=lost == 0,
        limit="0 lost",
    )
    jain = sum(speeds) ** 2 / (len(speeds) * sum(speed**2 for speed in speeds))
    yield promise(
        "Users who send the same work at once wait as long as each other.",
        f"{jain:.3f} (fairness index of Jain)",
        held=jain >= 0.9,
        limit="at least 0.9",
        waits=waits,
    )


def _insist(own: httpx2.Client, document: Json) -> tuple[str, float, int]:
    """Send a job until it is accepted; its id, when it was sent first, and how often it was refused."""
    sent, refusals = time.time(), 0
    while (answer := own.post("/v1/jobs", json={"scene": document})).status_code == 429:
        refusals += 1
        time.sleep(max(0.05, float(answer.headers["Retry-After"])))
    return answer.raise_for_status().json()["id"], sent, refusals


def neighbours(many: int = 300, visits: int = 5) -> Iterator[Promise]:
    """Count the tiles of one user that are finished between another's submission and its first tile."""
    with TemporaryDirectory() as folder:
        chosen = settings(Path(folder) / "data", log_level="debug")
        busy, *visitors = keys_for(chosen, 1 + visits)
        log = Path(folder) / "log"
        with (
            log.open("wb") as stderr,
            running(chosen, stderr=stderr) as server,
            client(server.url, busy) as own,
        ):
            crowd = {submit(own, {"scene": scene(number)})["id"] for number in range(many)}
            visited = []
            for number, key in enumerate(visitors):
                with client(server.url, key) as visitor:
                    visited.append(submit(visitor, {"scene": scene(many + number)}, wait=60)["id"])
        lines = [json.loads(line) for line in log.read_text().splitlines()]
    between = []
    for job in visited:
        start = next(
            n for n, line in enumerate(lines) if line["event"].startswith("job ") and line.get("job") == job
        )
        done = [line["job"] for line in lines[start:] if line["event"] == "task done" and "tile" in line]
        between.append(sum(other in crowd for other in done[: done.index(job)]))
    yield promise(
        f"One user's {many} jobs delay another's single job by at most 2 tiles for each worker.",
        f"{max(between)} tiles at most, in {visits} visits",
        held=max(between) <= 2,
        limit="2 tiles",
        between=between,
    )


def watchers(sizes: Sequence[int] = (1, 20, 200)) -> Iterator[Promise]:
    """Crowds follow a job each, half by server-sent events and half by long polling."""
    found = {}
    with TemporaryDirectory() as folder, running(settings(Path(folder), tile_size=32)) as server:
        for number, size in enumerate(sizes):
            found[size] = asyncio.run(_watched(server, size, number))
    least, most = min(sizes), max(sizes)
    complete = all(whole for _, _, whole in found.values())
    events = found[most][1]
    each = 1000 * (found[most][0] - found[least][0]) / ((most - least) * events)
    yield promise(
        f"{most} watchers of one job get every event in its order.",
        f"{most if complete else 'not all'} of {most}, {events} events each",
        held=complete,
        limit="all",
    )
    yield promise(
        "A watcher costs the service little.",
        f"{each:.2f} ms CPU for each watcher and event",
        held=each <= 1,
        limit="1 ms",
    )


async def _watched(server: RunningServer, size: int, number: int) -> tuple[float, int, bool]:
    """CPU seconds of the service, events, and whether every watcher had all of them in order."""
    limits = httpx2.Limits(max_connections=None)
    async with httpx2.AsyncClient(base_url=server.url, timeout=LONGEST, limits=limits) as own:
        before = cpu_seconds_of(server.process.pid)
        job = (await own.post("/v1/jobs", json={"scene": scene(number, side=192)})).json()["id"]
        seen = await asyncio.gather(*((_stream if n % 2 else _poll)(own, job) for n in range(size)))
        spent = cpu_seconds_of(server.process.pid) - before
        last = (await own.get(f"/v1/jobs/{job}")).json()["last_seq"]
    return spent, last, all(events == list(range(1, last + 1)) for events in seen)


async def _stream(own: httpx2.AsyncClient, job: str) -> list[int]:
    async with own.stream("GET", f"/v1/jobs/{job}/events") as answer:
        lines = [line async for line in answer.aiter_lines() if line.startswith("id:")]
    return [int(line.removeprefix("id:")) for line in lines]


async def _poll(own: httpx2.AsyncClient, job: str) -> list[int]:
    events: list[int] = []
    while True:
        news = (await own.get(f"/v1/jobs/{job}/tiles", params={"after": len(events), "wait": 30})).json()
        events += [event["seq"] for event in news["events"]]
        if news["complete"]:
            return events


def memory(jobs: int = 2000, step: int = 200) -> Iterator[Promise]:
    """Render many small pictures, and read the memory after every `step` of them."""
    taken: list[tuple[float, float]] = []
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder), workers=CORES)) as server,
        client(server.url) as own,
        ThreadPoolExecutor(8) as pool,
    ):
        for first in range(0, jobs, step):
            numbers = range(first, first + step)
            requests = [{"scene": scene(number, side=16, sampling=PLAIN)} for number in numbers]
            list(pool.map(lambda request: submit(own, request, wait=60), requests))
            workers = max(map(resident_mib, workers_of(server.process.pid)))
            taken.append((resident_mib(server.process.pid), workers))
    growth = [100 * (last / first - 1) for first, last in zip(taken[0], taken[-1], strict=True)]
    yield promise(
        f"Memory stays flat over {jobs:,} jobs.",
        f"server {taken[-1][0]:.0f} MiB ({growth[0]:+.1f} %), "
        f"largest worker {taken[-1][1]:.0f} MiB ({growth[1]:+.1f} %)",
        held=max(growth) <= 10,
        limit=f"+10 % after the first {step}",
        mib=taken,
    )


def pace(jobs: int = 300, runs: int = 9) -> Iterator[Promise]:
    """Accept jobs as fast as they are sent; then compare a job of two seconds with the same in process."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder))) as server,
        client(server.url) as own,
        ThreadPoolExecutor(4) as pool,
    ):
        before, begun = cpu_seconds_of(server.process.pid), time.perf_counter()
        list(pool.map(lambda number: submit(own, {"scene": scene(number)}), range(jobs)))
        rate = jobs / (time.perf_counter() - begun)
        cost = (cpu_seconds_of(server.process.pid) - before) / jobs
    yield promise(
        "Jobs are accepted faster than they are rendered.",
        f"{rate:.0f} a second, {1000 * cost:.1f} ms CPU of the service each",
        held=rate >= 20,
        limit="20 a second",
    )
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder), workers=CORES)) as server,
        Client(server.url) as sender,
    ):
        rounds = [_round(sender, seed) for seed in range(1, runs + 1)]
    ratio = statistics.median(sent / called for called, sent, _ in rounds)
    yield promise(
        "The service adds at most 5 % to a job of two seconds.",
        f"{100 * (ratio - 1):+.1f} % compared with rendering in process (median of {runs} runs)",
        held=ratio <= 1.05,
        limit="+5 %",
    )
    first = statistics.median(seconds for _, _, seconds in rounds)
    yield promise(
        "The first pixels of a job are there soon after it was sent.",
        f"{first:.3f} s (median of {runs})",
        held=first <= 0.5,
        limit="0.5 s",
    )


def _round(sender: Client, seed: int) -> tuple[float, float, float]:
    """Wall seconds of the job in process, as a job until its image has arrived, and until its first tile."""
    document: dict[str, Any] = json.loads((SCENES / "study" / "soft.json").read_text())
    document["sampling"] = {
        "antialiasing": {"pattern": "uniform", "samples": 9},
        "light": {"pattern": "uniform", "samples": 64},
        "seed": seed,
    }
    begun = time.perf_counter()
    renderer.render(renderer.compile_scene(document), workers=CORES)
    called, begun = time.perf_counter() - begun, time.perf_counter()
    sender.pixels(sender.wait(sender.submit(document).id).id)
    sent, begun = time.perf_counter() - begun, time.perf_counter()
    document["sampling"]["seed"] = -seed % 2**31
    job = sender.submit(document).id
    sender.tile_pixels(job, wait=20.0)
    first = time.perf_counter() - begun
    sender.cancel(job)
    return called, sent, first


PARTS: dict[str, Callable[[], Iterator[Promise]]] = {
    "crowds": crowds,
    "neighbours": neighbours,
    "watchers": watchers,
    "memory": memory,
    "pace": pace,
}


def main() -> None:
    """Measure the requested parts on an idle machine; 1 if a promise is not held."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.load", description=__doc__)
    parser.add_argument("parts", nargs="*", default=[*PARTS], metavar="PART", help=", ".join(PARTS))
    conclude("load", [one for part in parser.parse_args().parts for one in PARTS[part]()])


if __name__ == "__main__":
    main()
