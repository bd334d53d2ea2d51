"""Random faults among mixed jobs for minutes: nothing may be lost, hang or differ."""

from __future__ import annotations

import os
import signal
import statistics
import time
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2
import numpy as np

from benchmarks.chaos.ground import LONGEST, ended, image, picture, settings
from benchmarks.chaos.processes import MANY
from benchmarks.load.processes import workers_of
from benchmarks.load.promises import Promise, promise
from service.errors import UnavailableError
from service.server import running

if TYPE_CHECKING:
    from service.settings import Settings

OPEN = 6
"""Jobs that wait or run at a time."""
FAULTS = {"worker killed": 0.6, "worker stopped for a while": 0.2, "server killed": 0.2}
"""What happens, and its probability."""
PAUSES = 1.0, 4.0
STOPPED = 0.5, 4.0
SILENCE = 2.0
"""Seconds: between two faults, of a worker that is stopped, and until the service replaces it."""


def mixed(number: int) -> dict[str, Any]:
    """Give one request of several kinds: fixed quality, layers, a target error, priority."""
    request: dict[str, Any] = {"scene": picture(number)}
    match number % 4:
        case 1:
            request["layers"] = ["depth", "normal"]
        case 2:
            request["quality"] = {"mode": "target", "error": 0.01}
        case 3:
            request["scene"] = picture(number, samples=144)
    return request


KINDS = 4


class Ground:
    """A service that is killed and started again on the same folder."""

    def __init__(self, chosen: Settings, stack: ExitStack) -> None:
        self._chosen, self._outer = chosen, stack
        self._enter()

    def _enter(self) -> None:
        self._stack = self._outer.enter_context(ExitStack())
        self.server = self._stack.enter_context(running(self._chosen))
        self.client = self._stack.enter_context(httpx2.Client(base_url=self.server.url, timeout=LONGEST))

    def submit(self, number: int) -> str:
        """Send a job, and give its id."""
        headers = {"Cache-Control": "no-cache"}
        answer = self.client.post("/v1/jobs", json=mixed(number), headers=headers)
        answer.raise_for_status()
        return str(answer.json()["id"])

    def restart(self) -> None:
        """Kill the server, and start it again."""
        self.server.process.kill()
        self.server.process.wait()
        while True:
            self._stack.close()
            try:
                return self._enter()
            except UnavailableError:
                # On a busy machine a start may take longer than the minute that is waited for.
                continue

    def disturb(self, fault: str, chance: np.random.Generator) -> None:
        """Have something happen."""
        workers = workers_of(self.server.process.pid)
        if fault == "server killed":
            self.restart()
        elif workers:
            worker = workers[chance.integers(len(workers))]
            if fault == "worker killed":
                os.kill(worker, signal.SIGKILL)
            else:
                _stop_for(worker, chance.uniform(*STOPPED))

    def tiles(self, jobs: list[str]) -> int:
        """How many tiles of these jobs were reported."""
        return sum(int(self.client.get(f"/v1/jobs/{job}").json()["last_seq"]) for job in jobs)


def _stop_for(worker: int, seconds: float) -> None:
    try:
        os.kill(worker, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(worker, signal.SIGCONT)
    except ProcessLookupError:
        # The service has replaced it.
        return


def soak(minutes: float, seed: int = 3) -> Promise:
    """Disturb a service at random while mixed jobs are rendered; compare all pictures afterwards."""
    chance = np.random.default_rng(seed)
    sent: list[str] = []
    times: defaultdict[str, list[float]] = defaultdict(list)
    with TemporaryDirectory() as folder, ExitStack() as stack:
        expected = _undisturbed(Path(folder) / "before")
        chosen = settings(
            Path(folder) / "data", max_attempts=MANY, worker_silence_seconds=SILENCE, max_user_jobs=100_000
        )
        ground = Ground(chosen, stack)
        deadline = time.monotonic() + 60 * minutes
        while time.monotonic() < deadline:
            _fill(ground, sent)
            time.sleep(chance.uniform(*PAUSES))
            fault = str(chance.choice(list(FAULTS), p=list(FAULTS.values())))
            times[fault].append(_recovery(ground, sent[-2 * OPEN :], fault, chance))
        found = [ended(ground.client, job) for job in sent]
        same = sum(image(ground.client, job) == expected[n % KINDS] for n, job in enumerate(sent))
    lost = sum(job["state"] != "succeeded" for job in found)
    return _finding(minutes, times, jobs=len(sent), lost=lost, same=same)


def _undisturbed(folder: Path) -> list[bytes]:
    with ExitStack() as stack:
        ground = Ground(settings(folder), stack)
        jobs = [ground.submit(number) for number in range(KINDS)]
        return [image(ground.client, ended(ground.client, job)["id"]) for job in jobs]


def _fill(ground: Ground, sent: list[str]) -> None:
    """Submit as many jobs as are missing."""
    while sum(_is_open(ground, job) for job in sent[-2 * OPEN :]) < OPEN:
        sent.append(ground.submit(len(sent) % KINDS))


def _is_open(ground: Ground, job: str) -> bool:
    return ground.client.get(f"/v1/jobs/{job}").json()["finished_at"] is None


def _recovery(ground: Ground, jobs: list[str], fault: str, chance: np.random.Generator) -> float:
    """Seconds from a fault to the next tile of any job; a worker that is stopped does not count its stop."""
    begun = time.monotonic()
    ground.disturb(fault, chance)
    if fault == "worker stopped for a while":
        begun = time.monotonic()
    before = ground.tiles(jobs)
    while ground.tiles(jobs) == before and any(_is_open(ground, job) for job in jobs):
        if time.monotonic() - begun > LONGEST:
            break
        time.sleep(0.02)
    return time.monotonic() - begun


def _finding(minutes: float, times: dict[str, list[float]], *, jobs: int, lost: int, same: int) -> Promise:
    faults = ", ".join(f"{len(found)} x {fault}" for fault, found in sorted(times.items()))
    recovery = {
        fault: {"median": round(statistics.median(found), 2), "worst": round(max(found), 2)}
        for fault, found in times.items()
    }
    worst = max((one["worst"] for one in recovery.values()), default=0.0)
    return promise(
        "random faults among mixed jobs lose, hang and change nothing",
        f"{minutes:g} minutes, {faults}: {lost} of {jobs} jobs lost or hung, {same} pictures the same, "
        f"{worst:.1f} s to the next tile at worst",
        held=lost == 0 and same == jobs,
        limit="0 lost or hung, all the same",
        minutes=minutes,
        jobs=jobs,
        lost=lost,
        same=same,
        recovery=recovery,
    )
