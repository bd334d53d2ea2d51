"""The service under load, each promise with a figure."""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import httpx2

import renderer
from benchmarks.jobs import (
    CORES,
    LONGEST,
    client,
    cpu_seconds_of,
    ended,
    keys_for,
    resident_mib,
    scene,
    service,
    settings,
    submit,
    workers_of,
)
from benchmarks.report import SCENES, Json, Promise, conclude, parser, uniform
from service.client import Client
from service.server import RunningServer, running

if TYPE_CHECKING:
    from collections.abc import Iterator

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
                    found = [ended(own, job) for job, _, _ in sent]
                lost = sum(job["state"] != "succeeded" for job in found)
                finished = (datetime.fromisoformat(job["finished_at"]).timestamp() for job in found)
                waits = [end - begun for end, (_, begun, _) in zip(finished, sent, strict=True)]
                return lost, statistics.mean(waits), sum(refused for _, _, refused in sent)

            losses, waits, refusals = zip(*pool.map(all_of, range(users)), strict=True)
    lost, speeds = sum(losses), [1 / wait for wait in waits]
    yield Promise(
        f"Of {jobs} jobs that {users} users send at once none is lost, refused ones included.",
        f"{jobs - lost} of {jobs} rendered, {sum(refusals)} refused and sent again",
        "0 lost",
        lost == 0,
    )
    jain = sum(speeds) ** 2 / (len(speeds) * sum(speed**2 for speed in speeds))
    yield Promise(
        "Users who send the same work at once wait as long as each other.",
        f"{jain:.3f} (fairness index of Jain)",
        "at least 0.9",
        jain >= 0.9,
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
        with log.open("wb") as stderr, running(chosen, stderr=stderr) as server:
            with client(server.url, busy) as own:
                crowd = {submit(own, {"scene": scene(number)})["id"] for number in range(many)}
            visited = []
            for number, key in enumerate(visitors):
                with client(server.url, key) as visitor:
                    visited.append(submit(visitor, {"scene": scene(many + number)}, wait=60)["id"])
        lines = [json.loads(line) for line in log.read_text().splitlines()]
    most = 0
    for job in visited:
        of_job = (line["event"].startswith("job ") and line.get("job") == job for line in lines)
        later = lines[list(of_job).index(True) :]
        done = [line["job"] for line in later if line["event"] == "task done" and "tile" in line]
        most = max(most, sum(other in crowd for other in done[: done.index(job)]))
    yield Promise(
        f"One user's {many} jobs delay another's single job by at most 2 tiles for each worker.",
        f"{most} tiles at most, in {visits} visits",
        "2 tiles",
        most <= 2,
    )


def watchers(count: int = 200) -> Iterator[Promise]:
    """One and many follow a job each, half by server-sent events and half by long polling."""
    with service(tile_size=32) as (server, _):
        alone, _, _ = asyncio.run(_watched(server, 1))
        crowd, events, complete = asyncio.run(_watched(server, count))
    each = 1000 * (crowd - alone) / ((count - 1) * events)
    yield Promise(
        f"{count} watchers of one job get every event in its order.",
        f"{count if complete else 'not all'} of {count}, {events} events each",
        "all",
        complete,
    )
    yield Promise(
        "A watcher costs the service little.",
        f"{each:.2f} ms CPU for each watcher and event",
        "1 ms",
        each <= 1,
    )


async def _watched(server: RunningServer, count: int) -> tuple[float, int, bool]:
    """CPU seconds of the service, events, and whether every watcher had all of them in order."""
    limits = httpx2.Limits(max_connections=None)
    async with httpx2.AsyncClient(base_url=server.url, timeout=LONGEST, limits=limits) as own:
        before = cpu_seconds_of(server.process.pid)
        job = (await own.post("/v1/jobs", json={"scene": scene(count, side=192)})).json()["id"]
        seen = await asyncio.gather(*((_stream if n % 2 else _poll)(own, job) for n in range(count)))
        spent = cpu_seconds_of(server.process.pid) - before
        last = (await own.get(f"/v1/jobs/{job}")).json()["last_seq"]
    return spent, last, all(events == list(range(1, last + 1)) for events in seen)


async def _stream(own: httpx2.AsyncClient, job: str) -> list[int]:
    async with own.stream("GET", f"/v1/jobs/{job}/events") as answer:
        return [int(line[3:]) async for line in answer.aiter_lines() if line.startswith("id:")]


async def _poll(own: httpx2.AsyncClient, job: str) -> list[int]:
    events: list[int] = []
    while True:
        news = (await own.get(f"/v1/jobs/{job}/tiles", params={"after": len(events), "wait": 30})).json()
        events += [event["seq"] for event in news["events"]]
        if news["complete"]:
            return events


def memory(jobs: int = 2000, step: int = 200) -> Iterator[Promise]:
    """Render many small pictures, and read the memory after the first `step` of them and at the end."""
    with service(workers=CORES) as (server, own), ThreadPoolExecutor(8) as pool:

        def taken(numbers: range) -> tuple[float, float]:
            requests = [{"scene": scene(number, side=16, sampling=PLAIN)} for number in numbers]
            list(pool.map(lambda request: submit(own, request, wait=60), requests))
            process = server.process.pid
            return resident_mib(process), max(map(resident_mib, workers_of(process)))

        first, last = taken(range(step)), taken(range(step, jobs))
    growth = [100 * (after / before - 1) for before, after in zip(first, last, strict=True)]
    yield Promise(
        f"Memory stays flat over {jobs:,} jobs.",
        f"server {last[0]:.0f} MiB ({growth[0]:+.1f} %), "
        f"largest worker {last[1]:.0f} MiB ({growth[1]:+.1f} %)",
        f"+10 % after the first {step}",
        max(growth) <= 10,
    )


def pace(jobs: int = 300, runs: int = 9) -> Iterator[Promise]:
    """Accept jobs as fast as they are sent; then compare a job of two seconds with the same in process."""
    with service() as (server, own), ThreadPoolExecutor(4) as pool:
        before, begun = cpu_seconds_of(server.process.pid), time.perf_counter()
        list(pool.map(lambda number: submit(own, {"scene": scene(number)}), range(jobs)))
        rate = jobs / (time.perf_counter() - begun)
        cost = (cpu_seconds_of(server.process.pid) - before) / jobs
    yield Promise(
        "Jobs are accepted faster than they are rendered.",
        f"{rate:.0f} a second, {1000 * cost:.1f} ms CPU of the service each",
        "20 a second",
        rate >= 20,
    )
    with service(workers=CORES) as (server, _), Client(server.url) as sender:
        rounds = [_round(sender, seed) for seed in range(1, runs + 1)]
    called, sent, first = (statistics.median(seconds) for seconds in zip(*rounds, strict=True))
    yield Promise(
        "The service adds at most 5 % to a job of two seconds.",
        f"{sent:.2f} s, and {called:.2f} s in process (medians of {runs} runs)",
        "+5 %",
        sent <= 1.05 * called,
    )
    yield Promise(
        "The first pixels of a job are there soon after it was sent.",
        f"{first:.3f} s (median of {runs})",
        "0.5 s",
        first <= 0.5,
    )


def _round(sender: Client, seed: int) -> tuple[float, float, float]:
    """Wall seconds of the job in process, as a job until its image has arrived, and until its first tile."""
    document: Json = json.loads((SCENES / "study" / "soft.json").read_text())
    document["sampling"] = uniform(9, 64) | {"seed": seed}
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


PARTS = {part.__name__: part for part in (crowds, neighbours, watchers, memory, pace)}


def main() -> None:
    """Measure the requested parts on an idle machine; 1 if a promise is not held."""
    options = parser("load", __doc__)
    options.add_argument("parts", nargs="*", default=[*PARTS], metavar="PART", help=", ".join(PARTS))
    conclude("load", [one for part in options.parse_args().parts for one in PARTS[part]()])


if __name__ == "__main__":
    main()
