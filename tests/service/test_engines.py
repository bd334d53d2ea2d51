"""The contract of all engines: they run tasks, survive their crashes, and give them back on request."""

from __future__ import annotations

import os
import queue
import resource
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest

import renderer
from renderer import tiling
from schemas.api.jobs import JobRequest
from schemas.limits import Limits
from service.settings import Settings
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore
from service.workers.engines import engine_of
from service.workers.tasks import (
    Interrupted,
    Outcome,
    Task,
    TaskFailed,
    TileDone,
    TileTask,
    TraceDone,
    TraceTask,
    WorkerDied,
)
from service.workers.worker import WorkerSetup
from tests.service.support import scene, until

TIMEOUT = 60.0


class Bench:
    """An engine with one slot, a store with one job, and what was reported."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.before = _processes()
        self.store = TileStore(Folder(folder / "jobs"))
        Folder(folder).begin("assets")
        setup = WorkerSetup(str(folder), Limits(), 4 << 30)
        self.engine = engine_of(Settings.model_validate({"engine": kind, "workers": 1}), setup)
        self.reports: queue.Queue[tuple[Task, Outcome]] = queue.Queue()
        request = JobRequest.model_validate({"scene": scene(128, 64, samples=256, light_samples=64)})
        self.plan = renderer.compile_scene(request.scene)
        self.store.put_spec("job", request.model_dump_json(exclude_none=True).encode())
        self.engine.start(lambda task, outcome: self.reports.put((task, outcome)))
        until(self.engine.alive, TIMEOUT)

    def slots(self) -> set[int]:
        """Processes that render."""
        return {process for process in _processes() - self.before if _renders(process)}

    def tile(self, number: int = 0) -> TileTask:
        pass_ = self.plan.passes[-1]
        return TileTask("job", "hash", tiling.tiles(self.plan, pass_, 64)[number], pass_, attempt=1)

    def rays(self, origins: int = 1) -> TraceTask:
        return TraceTask(self.plan.document, np.zeros((origins, 3)), np.ones((1, 3)))

    def run(self, task: Task) -> Outcome:
        self.engine.submit(task)
        return self.outcome_of(task)

    def outcome_of(self, task: Task) -> Outcome:
        reported, outcome = self.reports.get(timeout=TIMEOUT)
        assert reported is task
        return outcome


def _processes() -> set[int]:
    """Processes below this one, without that which Python keeps for itself."""
    found = set()
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            if "resource_tracker" not in " ".join(process.cmdline()):
                found.add(process.pid)
    return found


def _renders(process: int) -> bool:
    """Whether the address space of a process is limited, as that of a slot is and no other."""
    try:
        return resource.prlimit(process, resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY
    except ProcessLookupError:
        return False


@pytest.fixture(scope="module", params=["slots", "dask"])
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    made = Bench(request.param, tmp_path_factory.mktemp("engine"))
    yield made
    # The last test has closed it already.
    if _processes() - made.before:
        made.engine.close()


def test_a_tile_lies_in_the_store_before_it_is_reported(bench: Bench) -> None:
    task = bench.tile()
    done = bench.run(task)
    assert isinstance(done, TileDone)
    stored = bench.store.get_tile("job", StoredTile(task.tile, task.pass_, 1, done.crc32))
    assert stored.tobytes() == renderer.render_tile(bench.plan, task.tile, task.pass_).pixels.tobytes()


def test_arrays_come_back_as_they_are(bench: Bench) -> None:
    done = bench.run(bench.rays())
    assert isinstance(done, TraceDone)
    expected = renderer.trace(bench.plan, np.zeros((1, 3)), np.ones((1, 3)))
    assert done.hits["t"].tobytes() == expected.t.tobytes()


def test_an_error_comes_back_with_its_code(bench: Bench) -> None:
    failed = bench.run(bench.rays(origins=2))
    assert isinstance(failed, TaskFailed)
    assert failed.code == "render_failed"


def test_there_is_room_for_more_than_what_runs_and_not_for_everything(bench: Bench) -> None:
    room = bench.engine.room()
    assert 2 <= room <= 4
    tasks = [bench.rays() for _ in range(room)]
    for task in tasks:
        bench.engine.submit(task)
    assert bench.engine.room() < room
    assert {bench.reports.get(timeout=TIMEOUT)[0] for _ in tasks} == set(tasks)
    assert bench.engine.room() == room


def test_a_task_whose_process_dies_is_blamed_and_those_behind_it_are_not(bench: Bench) -> None:
    (slot,) = bench.slots()
    first, second = bench.tile(0), bench.tile(1)
    before = _cpu_seconds(slot)
    bench.engine.submit(first)
    bench.engine.submit(second)
    until(lambda: _cpu_seconds(slot) > before)
    os.kill(slot, signal.SIGKILL)
    reports = dict(bench.reports.get(timeout=TIMEOUT) for _ in range(2))
    assert reports[first] == WorkerDied()
    assert isinstance(reports[second], TileDone | Interrupted)


def test_a_dead_process_is_replaced_and_works(bench: Bench) -> None:
    for slot in bench.slots():
        os.kill(slot, signal.SIGKILL)
    task = bench.tile()
    while not isinstance(outcome := _again(bench, task), TileDone):
        assert isinstance(outcome, WorkerDied | Interrupted)


def _again(bench: Bench, task: Task) -> Outcome:
    until(lambda: bench.engine.room() > 0)
    return bench.run(task)


def test_a_running_task_that_is_interrupted_is_not_blamed_and_its_process_is_killed(bench: Bench) -> None:
    until(lambda: len(bench.slots()) == 1)
    (slot,) = bench.slots()
    before, task = _cpu_seconds(slot), bench.tile()
    bench.engine.submit(task)
    until(lambda: _cpu_seconds(slot) > before)
    assert _interrupted(bench, task) == Interrupted()
    until(lambda: slot not in bench.slots())


def test_a_task_that_waits_is_interrupted_and_the_one_that_runs_continues(bench: Bench) -> None:
    running, waiting = bench.tile(0), bench.tile(1)
    bench.engine.submit(running)
    bench.engine.submit(waiting)
    reports: dict[Task, Outcome] = {}
    while len(reports) < 2:
        bench.engine.interrupt(lambda task: task is waiting)
        try:
            task, outcome = bench.reports.get(timeout=0.05)
        except queue.Empty:
            continue
        reports[task] = outcome
    assert isinstance(reports[running], TileDone)
    assert reports[waiting] == Interrupted()


def _interrupted(bench: Bench, task: Task) -> Outcome:
    """Ask for a task until it is given back, as the dispatcher does."""
    while True:
        bench.engine.interrupt(lambda running: running is task)
        try:
            return bench.reports.get(timeout=0.05)[1]
        except queue.Empty:
            pass


def test_nothing_unwanted_is_interrupted(bench: Bench) -> None:
    task = bench.tile()
    bench.engine.submit(task)
    bench.engine.interrupt(lambda _: False)
    assert isinstance(bench.outcome_of(task), TileDone)


def test_an_engine_that_is_closed_reports_nothing_and_leaves_no_process(bench: Bench) -> None:
    until(lambda: bench.engine.room() > 0)
    bench.engine.submit(bench.tile())
    until(lambda: bool(bench.slots()))
    bench.engine.close()
    until(lambda: not _processes() - bench.before)
    assert bench.reports.empty()


def _cpu_seconds(process: int) -> float:
    return psutil.Process(process).cpu_times().user
