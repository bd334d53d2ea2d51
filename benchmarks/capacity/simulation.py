"""Events on a simulated clock, which stops for nothing but the service's own decisions.

Accepting a job and a round of the dispatcher are real: they take turns at the database, and what they need of
the processor passes on the clock too. Rendering is not: a tile ends when its time is over.
"""

from __future__ import annotations

import asyncio
import heapq
import time
from collections import Counter, defaultdict
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from sqlalchemy import event

from benchmarks.capacity.workloads import request
from renderer import tiling
from schemas.api.administration import Role
from service.access.principals import LOCAL, Principal
from service.app import assemble
from service.dispatch.job_events import JobEvents
from service.dispatch.rounds import Round
from service.jobs.admission import Admitted, admit
from service.jobs.submission import Submission, enter
from service.lifecycle import rows
from service.settings import Settings
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from service.workers.tasks import ComposeDone, JobTask, Outcome, TileDone, TileTask

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from benchmarks.capacity.workloads import Workload
    from service.jobs.context import Service

COMPOSING = 0.005
"""Seconds for which a slot puts a small picture together."""
TURN = 64
"""Jobs that are accepted, at most, before the dispatcher has its turn."""
WINDOW = 2
"""Tasks that a slot holds: the second starts when the first one ends."""


NO_LIMIT = 10**9


@dataclass
class Outcomes:
    """What a simulation has seen.

    Attributes
    ----------
    waits, totals : ndarray
        Seconds from a job's arrival to the start of its first tile, and to its end, (jobs,).
    senders : ndarray
        Number of the user who sent it, (jobs,).
    seconds, rendered : float
        On the simulated clock, from the first arrival to the last end; and the sum of what tasks took.
    busy : dict
        CPU seconds of accepting and of rounds.
    done : Counter
        Jobs accepted, rounds, tasks, and statements sent to the database.
    """

    waits: NDArray[np.float64]
    totals: NDArray[np.float64]
    senders: NDArray[np.int64]
    seconds: float = 0.0
    rendered: float = 0.0
    busy: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    done: Counter[str] = field(default_factory=Counter)


class Simulation:
    """One run of a workload; ``run`` it once."""

    def __init__(self, workload: Workload, folder: Path, url: str | None = None) -> None:
        self.here: Service = _service(folder, url)
        self._admitted: Admitted = _admitted(self.here, workload.cpu_seconds)
        self._arrivals, self._factors = workload.arrivals(), workload.factors()
        nothing = np.full(workload.jobs, np.nan)
        self.found = Outcomes(nothing, nothing.copy(), workload.senders())
        self._seconds, self._slots = workload.cpu_seconds, workload.slots
        self._all_work = _work(self._admitted)
        self._numbers: dict[str, int] = {}
        self._next = 0
        self._clock = 0.0
        # When each slot is free, and what ends when; numbers order tasks that end together.
        self._free = [0.0] * workload.slots
        self._running: list[tuple[float, int, JobTask, Outcome]] = []
        self._flying: set[JobTask] = set()

    def run(self, report: Callable[[int], None] = lambda _: None) -> Outcomes:
        """Run until every job is finished; ``report`` receives how many have arrived."""
        event.listen(self.here.database.engine, "before_cursor_execute", self._count)
        while self._next < len(self._arrivals) or self._running:
            self._clock = max(self._clock, self._soonest())
            self._accept()
            self._round()
            report(self._next)
        self.here.database.close()
        self.found.seconds = self._clock - float(self._arrivals[0])
        return self.found

    def _count(self, *_: object) -> None:
        self.found.done["statements"] += 1

    def _soonest(self) -> float:
        arrival = self._arrivals[self._next] if self._next < len(self._arrivals) else np.inf
        return float(min(arrival, self._running[0][0] if self._running else np.inf))

    @contextmanager
    def _passing(self, what: str) -> Iterator[None]:
        """Let the clock run while the service decides something."""
        begun = time.thread_time()
        yield
        spent = time.thread_time() - begun
        self._clock += spent
        self.found.busy[what] += spent

    def _accept(self) -> None:
        for _ in range(TURN):
            if self._next >= len(self._arrivals) or self._arrivals[self._next] > self._clock:
                return
            principal = Principal(f"user {self.found.senders[self._next]}", Role.SUBMIT)
            with self._passing("accepting"):
                taken = enter(self.here, Submission(principal, b"{}", anew=True), self._admitted)
            self._numbers[taken.job] = self._next
            self._next += 1
            self.found.done["accepted"] += 1

    def _round(self) -> None:
        reports = list(self._ended())
        room = WINDOW * self._slots - len(self._flying)
        round_ = Round(reports=reports, flying=self._flying, leaving={}, room=room, max_attempts=3)
        with self._passing("rounds"), self.here.database.writing() as session:
            round_.decide(session)
        self.found.done["rounds"] += 1
        for render in round_.ended:
            number = self._numbers.pop(render)
            self.found.totals[number] = self._clock - self._arrivals[number]
        for task in round_.tasks:
            self._start(task)

    def _ended(self) -> Iterator[tuple[JobTask, Outcome]]:
        while self._running and self._running[0][0] <= self._clock:
            _, _, task, outcome = heapq.heappop(self._running)
            self._flying.discard(task)
            yield task, outcome

    def _start(self, task: JobTask) -> None:
        begun = max(self._clock, heapq.heappop(self._free))
        number = self._numbers[task.job]
        if np.isnan(self.found.waits[number]):
            self.found.waits[number] = begun - self._arrivals[number]
        seconds, outcome = self._rendered(task)
        self.found.rendered += seconds
        heapq.heappush(self._free, begun + seconds)
        self.found.done["tasks"] += 1
        heapq.heappush(self._running, (begun + seconds, self.found.done["tasks"], task, outcome))
        self._flying.add(task)

    def _rendered(self, task: JobTask) -> tuple[float, Outcome]:
        """Say how long a task takes, and how it ends."""
        if not isinstance(task, TileTask):
            return COMPOSING, ComposeDone(sha256="0" * 64, numerics={})
        work = rows.work(task.pass_, task.tile)
        factor = self._factors[self.found.done["tasks"] % len(self._factors)]
        seconds = float(self._seconds * work / self._all_work * factor)
        return seconds, TileDone(crc32=0, counts={"camera": work}, cpu_seconds=seconds)


class Nowhere(TileStore):
    """Forgets what jobs ask for: a simulation renders nothing."""

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep nothing."""

    def drop_job(self, job: str) -> None:
        """Forget nothing."""


def _service(folder: Path, url: str | None) -> Service:
    """Make the parts of a service, with a database in a folder or at a URL, whose dispatcher does not run."""
    settings = Settings(
        data=folder,
        database=url,
        max_queued_jobs=NO_LIMIT,
        max_queued_cpu_seconds=NO_LIMIT,
        max_user_jobs=NO_LIMIT,
        max_user_cpu_seconds=NO_LIMIT,
        log_level="error",
    )
    return asyncio.run(_assembled(settings))


async def _assembled(settings: Settings) -> Service:
    # Job events need the loop that its readers run on; here there are none.
    return assemble(settings, JobEvents(), Nowhere(Folder(settings.data / "jobs")))


def _admitted(here: Service, cpu_seconds: float) -> Admitted:
    """Admit the job that all users send, at a price of this many CPU seconds."""
    found = admit(here, LOCAL, request())
    cost = found.description.cost.model_copy(update={"cpu_seconds": cpu_seconds})
    return replace(found, description=found.description.model_copy(update={"cost": cost}))


def _work(job: Admitted) -> int:
    """Count the camera samples of a job, those of its coarse picture too."""
    plan = job.plan
    return sum(rows.work(pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, None))
