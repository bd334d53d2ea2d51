"""Random faults among mixed jobs: nothing may be lost, hang or differ."""

from __future__ import annotations

import os
import signal
import time
from collections import Counter
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.jobs import LONGEST, client, ended, scene, settings, submit, workers_of
from benchmarks.report import Json, Promise, conclude, parser, uniform
from service.errors import UnavailableError
from service.server import running

if TYPE_CHECKING:
    from service.settings import Settings

OPEN = 6
"""Jobs that wait or run at a time."""
FAULTS = {"worker killed": 0.6, "worker stopped for a while": 0.2, "server killed": 0.2}
"""Faults and their probabilities."""
PAUSES = 1.0, 4.0
STOPPED = 0.5, 4.0
SILENCE = 2.0
"""Seconds: between two faults, of a worker that is stopped, and until the service replaces it."""
KINDS = 4


def mixed(kind: int) -> Json:
    """A request of one of several kinds: fixed quality, layers, a target error, many samples."""
    sampling = uniform(144 if kind == 3 else 36, 36)
    more: dict[int, Json] = {
        1: {"layers": ["depth", "normal"]},
        2: {"quality": {"mode": "target", "error": 0.01}},
    }
    return {"scene": scene(kind, sampling=sampling)} | more.get(kind, {})


class Ground:
    """A service that is killed and started again on the same folder."""

    def __init__(self, chosen: Settings, stack: ExitStack) -> None:
        self._chosen, self._outer = chosen, stack
        self._enter()

    def _enter(self) -> None:
        self._stack = self._outer.enter_context(ExitStack())
        self.server = self._stack.enter_context(running(self._chosen))
        self.client = self._stack.enter_context(client(self.server.url))

    def submit(self, number: int) -> str:
        """Send a job, and give its id."""
        return str(submit(self.client, mixed(number % KINDS))["id"])

    def image(self, job: str) -> bytes:
        """The bytes of a picture."""
        return self.client.get(f"/v1/jobs/{job}/image.npy").content

    def progress(self, jobs: list[str]) -> tuple[int, int]:
        """Number of these jobs that have not ended, and of tiles reported for all."""
        found = [self.client.get(f"/v1/jobs/{job}").json() for job in jobs]
        return sum(job["finished_at"] is None for job in found), sum(job["last_seq"] for job in found)

    def restart(self) -> None:
        """Kill the server, and start it again, which may fail on a busy machine."""
        self.server.process.kill()
        self.server.process.wait()
        started = False
        while not started:
            self._stack.close()
            with suppress(UnavailableError):
                self._enter()
                started = True

    def disturb(self, fault: str, chance: np.random.Generator) -> None:
        """Have something happen."""
        workers = workers_of(self.server.process.pid)
        if fault == "server killed":
            self.restart()
        elif workers:
            # The service may have replaced it by now.
            with suppress(ProcessLookupError):
                worker = workers[chance.integers(len(workers))]
                if fault == "worker killed":
                    os.kill(worker, signal.SIGKILL)
                else:
                    os.kill(worker, signal.SIGSTOP)
                    time.sleep(chance.uniform(*STOPPED))
                    os.kill(worker, signal.SIGCONT)

    def recovery(self, jobs: list[str], fault: str, chance: np.random.Generator) -> float:
        """Seconds from a fault, or from the end of a worker's stop, to the next tile of any job."""
        begun = time.monotonic()
        self.disturb(fault, chance)
        if fault == "worker stopped for a while":
            begun = time.monotonic()
        _, before = self.progress(jobs)
        while time.monotonic() < begun + LONGEST:
            unfinished, tiles = self.progress(jobs)
            if tiles != before or not unfinished:
                break
            time.sleep(0.02)
        return time.monotonic() - begun


def soak(minutes: float, seed: int = 3) -> Promise:
    """Disturb a service at random while mixed jobs are rendered; compare all pictures afterwards."""
    chance = np.random.default_rng(seed)
    sent: list[str] = []
    faults: Counter[str] = Counter()
    worst = 0.0
    with TemporaryDirectory() as folder, ExitStack() as stack:
        usual = {"workers": 2, "tile_size": 32}
        calm = Ground(settings(Path(folder) / "before", **usual), stack)
        expected = [calm.image(ended(calm.client, calm.submit(kind))["id"]) for kind in range(KINDS)]
        tough = {"max_attempts": 10_000, "worker_silence_seconds": SILENCE, "max_user_jobs": 100_000}
        ground = Ground(settings(Path(folder) / "data", **usual, **tough), stack)
        deadline = time.monotonic() + 60 * minutes
        while time.monotonic() < deadline:
            while ground.progress(sent[-2 * OPEN :])[0] < OPEN:
                sent.append(ground.submit(len(sent)))
            time.sleep(chance.uniform(*PAUSES))
            fault = str(chance.choice(list(FAULTS), p=list(FAULTS.values())))
            faults[fault] += 1
            worst = max(worst, ground.recovery(sent[-2 * OPEN :], fault, chance))
        lost = sum(ended(ground.client, job)["state"] != "succeeded" for job in sent)
        same = sum(ground.image(job) == expected[n % KINDS] for n, job in enumerate(sent))
    happened = ", ".join(f"{count} x {fault}" for fault, count in sorted(faults.items()))
    return Promise(
        "Random faults among mixed jobs lose, hang and change nothing.",
        f"{minutes:g} minutes, {happened}: {lost} of {len(sent)} jobs lost or hung, {same} pictures "
        f"the same, {worst:.1f} s to the next tile at worst",
        "0 lost or hung, all the same",
        lost == 0 and same == len(sent),
    )


def main() -> None:
    """Soak for some minutes; 1 if anything was lost, hung or differed."""
    options = parser("soak", __doc__)
    options.add_argument("--minutes", type=float, default=30.0, help="how long; 30 by default")
    conclude("soak", [soak(options.parse_args().minutes)])


if __name__ == "__main__":
    main()
