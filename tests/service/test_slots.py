"""The engine of one machine when its processes die; ``test_engines.py`` tests what all engines do."""

from __future__ import annotations

import os
import queue
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import renderer
from benchmarks.load.processes import fork_servers_of, is_alive
from renderer import tiling
from schemas.api.jobs import JobRequest
from schemas.limits import Limits
from schemas.tiles import Tile
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from service.workers.heartbeats import Lease
from service.workers.slots import SlotEngine
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

REPORT_SECONDS = 60.0


class Bench:
    """One slot, a store with one job, and what was reported."""

    def __init__(
        self,
        folder: Path,
        document: dict[str, object],
        memory_bytes: int = 4 << 30,
        lease: Lease | None = None,
    ) -> None:
        self.store = TileStore(Folder(folder / "jobs"))
        setup = WorkerSetup(str(folder), Limits(), memory_bytes, lease or Lease())
        self.engine = SlotEngine(1, setup)
        self.reports: queue.Queue[tuple[Task, Outcome]] = queue.Queue()
        request = JobRequest.model_validate({"scene": document})
        self.plan = renderer.compile_scene(request.scene)
        self.store.put_spec("job", request.model_dump_json(exclude_none=True).encode())
        self.engine.start(lambda task, outcome: self.reports.put((task, outcome)))
        until(self.engine.alive)

    def tile(self, number: int = 0) -> TileTask:
        pass_ = self.plan.passes[-1]
        return TileTask("job", "hash", tiling.tiles(self.plan, pass_, 64)[number], pass_, attempt=1)

    def outcome(self) -> Outcome:
        return self.reports.get(timeout=REPORT_SECONDS)[1]

    def worker(self) -> int:
        until(self.engine.alive)
        (slot,) = self.engine._slots  # noqa: SLF001  (only a test kills a process)
        assert slot.pid is not None
        return slot.pid


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path, scene(128, 64, samples=256, light_samples=64))
    yield made
    made.engine.close()


def test_only_the_running_task_is_blamed_for_a_death(bench: Bench) -> None:
    first, second = bench.tile(0), bench.tile(1)
    worker = bench.worker()
    bench.engine.submit(first)
    bench.engine.submit(second)
    os.kill(worker, signal.SIGKILL)
    reports = dict(bench.reports.get(timeout=REPORT_SECONDS) for _ in range(2))
    assert reports == {first: WorkerDied(), second: Interrupted()}


def _again(bench: Bench, task: TileTask) -> Outcome:
    bench.engine.submit(task)
    return bench.outcome()


def test_a_worker_that_dies_with_nothing_to_do_is_replaced_at_once(bench: Bench) -> None:
    worker = bench.worker()
    os.kill(worker, signal.SIGKILL)
    until(lambda: bench.engine.alive() and bench.worker() != worker)


def test_a_task_that_never_ends_fails_alone(tmp_path: Path) -> None:
    bench = Bench(tmp_path, scene(128, 64, samples=1), lease=Lease(silent_seconds=1.0, task_seconds=1.0))
    after = bench.tile(1)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "jobs" / "endless").mkdir()
    # Opening it to read waits for a writer, which never comes.
    (tmp_path / "jobs" / "endless" / "spec.json").symlink_to(tmp_path / "pipe")
    endless = replace(bench.tile(0), job="endless", spec_sha256="other")
    bench.engine.submit(endless)
    bench.engine.submit(after)
    reports = dict(bench.reports.get(timeout=REPORT_SECONDS) for _ in range(2))
    assert reports[after] == Interrupted()
    failed = reports[endless]
    assert isinstance(failed, TaskFailed)
    assert (failed.code, failed.passes) == ("took_too_long", False)
    assert isinstance(_again(bench, after), TileDone)
    bench.engine.close()


def test_a_stopped_worker_is_found_by_its_silence_and_blamed_like_a_dead_one(tmp_path: Path) -> None:
    bench = Bench(tmp_path, scene(128, 64, samples=1), lease=Lease(silent_seconds=1.0))
    worker = bench.worker()
    os.kill(worker, signal.SIGSTOP)
    task = bench.tile()
    bench.engine.submit(task)
    assert bench.outcome() == WorkerDied()
    assert isinstance(_again(bench, task), TileDone)
    assert bench.worker() != worker
    bench.engine.close()


def test_a_stopped_worker_that_is_sent_more_than_a_pipe_holds_is_found_too(tmp_path: Path) -> None:
    bench = Bench(tmp_path, scene(128, 64, samples=1), lease=Lease(silent_seconds=1.0))
    os.kill(bench.worker(), signal.SIGSTOP)
    many = np.ones((1 << 20, 3))
    bench.engine.submit(TraceTask(bench.plan.document, many, many))
    assert isinstance(bench.outcome(), WorkerDied | Interrupted)
    assert isinstance(_again(bench, bench.tile()), TileDone)
    bench.engine.close()


def test_a_task_that_needs_too_much_memory_fails_alone(tmp_path: Path) -> None:
    bench = Bench(tmp_path, scene(16384, 16384, samples=1), memory_bytes=2 << 30)
    pass_ = bench.plan.passes[-1]
    bench.engine.submit(TileTask("job", "hash", Tile(0, 0, 0, 16384, 16384), pass_, attempt=1))
    bench.engine.submit(bench.tile())
    outcomes = [bench.outcome(), bench.outcome()]
    bench.engine.close()
    assert isinstance(outcomes[0], TaskFailed)
    assert outcomes[0].code == "out_of_memory"
    assert isinstance(outcomes[1], TileDone)


@pytest.mark.slow
def test_a_worker_that_is_killed_in_the_middle_of_a_large_answer_is_replaced(bench: Bench) -> None:
    """Killed at five moments about the end of a task whose answer takes a while to travel."""
    rays = 150_000
    directions = np.tile([[0.0, 0.0, -1.0]], (rays, 1))
    task = TraceTask(bench.plan.document, np.zeros((rays, 3)), directions)
    begun = time.monotonic()
    bench.engine.submit(task)
    assert isinstance(bench.outcome(), TraceDone)
    lasted = time.monotonic() - begun
    for share in np.linspace(0.7, 1.0, 5):
        worker = bench.worker()
        bench.engine.submit(task)
        time.sleep(share * lasted)
        os.kill(worker, signal.SIGKILL)
        assert isinstance(bench.outcome(), WorkerDied | TraceDone)
        until(partial(_replaced, bench, worker))
    bench.engine.submit(bench.tile())
    assert isinstance(bench.outcome(), TileDone)


def _replaced(bench: Bench, worker: int) -> bool:
    return bench.engine.room() == 2 and bench.worker() != worker


def test_a_fork_server_has_one_thread(bench: Bench) -> None:
    """A lock that another thread holds when it forks would stay locked in the worker."""
    bench.worker()
    (process,) = fork_servers_of(os.getpid())
    assert len(list(Path(f"/proc/{process}/task").iterdir())) == 1


@pytest.mark.slow
def test_a_fork_server_that_was_stopped_is_replaced(tmp_path: Path) -> None:
    bench = Bench(tmp_path, scene(128, 64, samples=1), lease=Lease(start_seconds=10.0))
    worker = bench.worker()
    (process,) = fork_servers_of(os.getpid())
    os.kill(process, signal.SIGSTOP)
    os.kill(worker, signal.SIGKILL)
    until(lambda: bench.engine.alive() and bench.worker() != worker, seconds=60.0)
    assert isinstance(_again(bench, bench.tile()), TileDone)
    bench.engine.close()


def test_an_engine_closes_though_its_fork_server_was_stopped(bench: Bench) -> None:
    worker = bench.worker()
    (process,) = fork_servers_of(os.getpid())
    os.kill(process, signal.SIGSTOP)
    os.kill(worker, signal.SIGKILL)
    until(lambda: not bench.engine.alive())
    bench.engine.close()
    until(lambda: not is_alive(process))
