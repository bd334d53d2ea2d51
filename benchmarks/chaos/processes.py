"""Workers and servers that are killed or stopped."""

from __future__ import annotations

import os
import signal
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx2
import numpy as np

from benchmarks.chaos.ground import (
    LONGEST,
    ended,
    image,
    picture,
    settings,
    steps,
    submit,
    until,
)
from benchmarks.load.processes import is_alive, workers_of
from benchmarks.load.promises import Promise
from service.server import running

# More deaths than a tile can have: what is measured is the cost of each.
MANY = 10_000
ORPHAN_SECONDS = 1.0


def undisturbed(jobs: int) -> list[bytes]:
    """Render pictures while nothing happens."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder))) as server,
        httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
    ):
        sent = [submit(client, picture(number)) for number in range(jobs)]
        return [image(client, ended(client, job)["id"]) for job in sent]


def workers_killed(kills: int, jobs: int, expected: list[bytes]) -> Promise:
    """Kill workers at random times while jobs are rendered."""
    chance = np.random.default_rng(1)
    with TemporaryDirectory() as folder, running(settings(Path(folder), max_attempts=MANY)) as server:
        with httpx2.Client(base_url=server.url, timeout=LONGEST) as client:
            sent = [submit(client, picture(number % len(expected))) for number in range(jobs)]
            for _ in range(kills):
                until(lambda: len(workers_of(server.process.pid)) == 2)
                time.sleep(chance.uniform(0.2, 1.0))
                _kill_one(workers_of(server.process.pid), chance)
            found = [ended(client, job) for job in sent]
            same = sum(image(client, job) == expected[n % len(expected)] for n, job in enumerate(sent))
        rows = steps(Path(folder)).values()
    hung = sum(job["state"] != "succeeded" for job in found)
    deaths = sum(row[2] for row in rows)
    return Promise(
        promise="a killed worker costs its tile one retry, and the picture is the same",
        measured=f"{kills} SIGKILLs, {deaths} tiles tried again, {hung} jobs hung, {same} of {jobs} the same",
        held=hung == 0 and same == jobs and deaths <= kills,
        limit="0 hung, 1 retry each, all the same",
        details={"kills": kills, "jobs": jobs, "deaths": deaths, "hung": hung, "same": same},
    )


def _gone(processes: list[int]) -> bool:
    return not any(map(is_alive, processes))


def _kill_one(workers: list[int], chance: np.random.Generator) -> None:
    if workers:
        os.kill(workers[chance.integers(len(workers))], signal.SIGKILL)


def server_killed(kills: int, expected: list[bytes]) -> Promise:
    """Kill the server at random times, and start it again on the same folder."""
    chance, sent = np.random.default_rng(2), list[str]()
    earlier: dict[tuple[int, int, int], tuple[object, ...]] = {}
    again = orphans = 0
    with TemporaryDirectory() as folder:
        data = Path(folder)
        for kill in range(kills):
            with running(settings(data)) as server, httpx2.Client(base_url=server.url) as client:
                sent.append(submit(client, picture(kill % len(expected))))
                time.sleep(chance.uniform(0.0, 2.0))
                workers = workers_of(server.process.pid)
                server.process.kill()
                server.process.wait()
            orphans += not until(partial(_gone, workers), ORPHAN_SECONDS)
            before = {place: row for place, row in steps(data).items() if row[0] == "done"}
            again += sum(before.get(place) != row for place, row in earlier.items() if place in before)
            earlier = before
        with (
            running(settings(data)) as server,
            httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
        ):
            found = [ended(client, job) for job in sent]
            same = sum(image(client, job) == expected[n % len(expected)] for n, job in enumerate(sent))
            litter = len(list(data.rglob(".*.tmp")))
    lost = sum(job["state"] != "succeeded" for job in found)
    return Promise(
        promise="a killed server loses nothing accepted and renders no finished tile again",
        measured=f"{kills} SIGKILLs, {lost} jobs lost, {again} tiles again, "
        f"{orphans} with orphans after 1 s, {litter} temporary files, {same} of {len(sent)} the same",
        held=lost == again == orphans == litter == 0 and same == len(sent),
        limit="0 of each, all the same",
        details={"kills": kills, "lost": lost, "again": again, "orphans": orphans, "litter": litter},
    )


def server_terminated(expected: list[bytes]) -> Promise:
    """End the server by SIGTERM while jobs run, and start it again."""
    with TemporaryDirectory() as folder:
        chosen = settings(Path(folder))
        with running(chosen) as server, httpx2.Client(base_url=server.url, timeout=LONGEST) as client:
            sent = [submit(client, picture(number)) for number in range(len(expected))]
            begun = time.monotonic()
            server.process.terminate()
            server.process.wait(LONGEST)
            seconds = time.monotonic() - begun
        with running(chosen) as server, httpx2.Client(base_url=server.url, timeout=LONGEST) as client:
            same = sum(image(client, ended(client, job)["id"]) == expected[n] for n, job in enumerate(sent))
    return Promise(
        promise="a server that is stopped reclaims its running tasks, and loses nothing",
        measured=f"ended after {seconds:.1f} s, {same} of {len(sent)} pictures the same afterwards",
        held=same == len(sent) and seconds < 10.0,
        limit="10 s, all the same",
        details={"seconds": round(seconds, 2), "same": same},
    )


def worker_stopped(expected: list[bytes]) -> Promise:
    """Stop a worker that has work, and wait for its replacement."""
    lease = 2.0
    with TemporaryDirectory() as folder:
        chosen = settings(Path(folder), workers=1, worker_silence_seconds=lease)
        with running(chosen) as server, httpx2.Client(base_url=server.url, timeout=LONGEST) as client:
            job = submit(client, picture(0))
            (stopped,) = workers_of(server.process.pid)
            os.kill(stopped, signal.SIGSTOP)
            begun = time.monotonic()
            found = until(lambda: not is_alive(stopped))
            seconds = time.monotonic() - begun
            same = image(client, ended(client, job)["id"]) == expected[0]
    return Promise(
        promise="a suspended worker is detected by its silence, and its tile rendered again",
        measured=f"replaced after {seconds:.1f} s, picture {'the same' if same else 'another'}",
        held=found and same and seconds < 3 * lease,
        limit=f"{3 * lease:g} s with a lease of {lease:g} s, the same",
        details={"seconds": round(seconds, 2), "lease": lease},
    )
