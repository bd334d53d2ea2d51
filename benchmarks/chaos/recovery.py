"""How long it takes until the next tile after a worker, a leader or a scheduler is killed, and to start."""

from __future__ import annotations

import os
import signal
import statistics
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.chaos.ground import LONGEST, picture, settings, submit, until
from benchmarks.load.processes import workers_of
from benchmarks.load.promises import Promise, promise
from service.server import RunningServer, running
from tests.postgres_server import PostgresServer, programs
from tests.service.dask_cluster import Cluster

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from service.settings import Settings

# Minutes of work in steps of a fraction of a second: no job ends while its service is disturbed.
SIDE, SAMPLES = 768, 256
# What was on its way from a process that was killed is reported by then, and no new process has started.
SETTLED_SECONDS = 0.2
WORKER, LEADER, SCHEDULER, START = (1.0, 3.0), (5.0, 10.0), (15.0, 30.0), (3.0, 3.0)
"""Goals: seconds in the median, and at worst."""


def tiles_of(client: httpx2.Client, job: str) -> int:
    """How many tiles of a job were reported so far."""
    return int(client.get(f"/v1/jobs/{job}").json()["last_seq"])


def seconds_to_next_tile(client: httpx2.Client, job: str, disturb: Callable[[], None]) -> float:
    """Disturb a service that renders a job, and measure until it reports another tile of it."""
    begun = time.monotonic()
    disturb()
    time.sleep(SETTLED_SECONDS)
    after = tiles_of(client, job)
    until(lambda: tiles_of(client, job) > after)
    found = time.monotonic() - begun
    if client.get(f"/v1/jobs/{job}").json()["finished_at"]:
        raise RuntimeError("The job has ended, so nothing is measured: make its picture larger.")
    return found


def worker_killed(times: int) -> Promise:
    """Kill the only worker."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder), workers=1, max_attempts=10 * times)) as server,
        _client(server) as client,
    ):
        job = _begun(client)
        found = [seconds_to_next_tile(client, job, lambda: _kill_worker(server)) for _ in range(times)]
    return _finding("the next tile after a worker is killed", found, WORKER)


def leader_killed(times: int) -> Promise:
    """Kill the leader of two servers, and start it again for the next time."""
    found_programs = programs()
    if found_programs is None:
        return promise("the next tile after the leader is killed", "no PostgreSQL here", held=True, limit="-")
    postgres, found = PostgresServer(found_programs), []
    try:
        with TemporaryDirectory() as folder:
            chosen = settings(Path(folder), workers=1, database=postgres.database(), max_attempts=10 * times)
            found = _leaders_killed(chosen, times)
    finally:
        postgres.close()
    return _finding("the next tile after the leader is killed", found, LEADER)


def _leaders_killed(chosen: Settings, times: int) -> list[float]:
    found = []
    with ExitStack() as stack:
        leader, other = (stack.enter_context(running(chosen)) for _ in range(2))
        with _client(leader) as client:
            job = _begun(client)
        for _ in range(times):
            with _client(other) as client:
                found.append(seconds_to_next_tile(client, job, _killer(leader)))
            leader, other = other, stack.enter_context(running(chosen))
    return found


def scheduler_killed(times: int) -> Promise:
    """Kill the scheduler of a Dask cluster with one worker; what supervises them starts both again."""
    cluster = Cluster()
    try:
        cluster.start_worker()
        with TemporaryDirectory() as folder:
            chosen = settings(Path(folder), engine="dask", dask=cluster.address, max_attempts=10 * times)
            with running(chosen) as server, _client(server) as client:
                job = _begun(client)
                found = [seconds_to_next_tile(client, job, lambda: _restart(cluster)) for _ in range(times)]
    finally:
        cluster.close()
    return _finding("the next tile after a Dask scheduler is killed and started again", found, SCHEDULER)


def started(times: int) -> Promise:
    """Start a service on a folder that it has used before."""
    found = []
    with TemporaryDirectory() as folder:
        for _ in range(times + 1):
            begun = time.monotonic()
            with running(settings(Path(folder))):
                found.append(time.monotonic() - begun)
    return _finding("a service is ready after it was started", found[1:], START)


def _client(server: RunningServer) -> httpx2.Client:
    return httpx2.Client(base_url=server.url, timeout=LONGEST)


def _begun(client: httpx2.Client) -> str:
    """Submit a long job, and wait for its first tiles."""
    document = picture(0, samples=SAMPLES)
    document["camera"] |= {"width": SIDE, "height": SIDE}
    job = submit(client, document)
    until(lambda: tiles_of(client, job) >= 2)
    return job


def _kill_worker(server: RunningServer) -> None:
    for worker in workers_of(server.process.pid):
        os.kill(worker, signal.SIGKILL)


def _killer(server: RunningServer) -> Callable[[], None]:
    def kill() -> None:
        server.process.kill()
        server.process.wait()

    return kill


def _restart(cluster: Cluster) -> None:
    for process in (*cluster.workers, cluster.scheduler):
        process.kill()
        process.wait()
    cluster.restart()


def _finding(what: str, found: Sequence[float], goal: tuple[float, float]) -> Promise:
    median, worst = statistics.median(found), max(found)
    details: dict[str, Any] = {"seconds": [round(one, 2) for one in found]}
    return promise(
        what,
        f"{median:.1f} s in the median of {len(found)}, {worst:.1f} s at worst",
        held=median <= goal[0] and worst <= goal[1],
        limit=f"{goal[0]:g} s, {goal[1]:g} s",
        **details,
    )
