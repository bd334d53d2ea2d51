"""The engine of one machine when its processes die, hang, or take too much."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from schemas.tiles import Tile
from service.workers.heartbeats import Lease
from service.workers.tasks import CallDone, Interrupted, TaskFailed, TileDone, TileTask, TraceTask, WorkerDied
from tests.service.processes import fork_servers_of, is_alive
from tests.service.support import TIMEOUT, scene, until
from tests.service.workers.bench import Bench

SMALL = scene(128, 64, samples=1)

Make = Callable[..., Bench]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    made: list[Bench] = []

    def begin(document: dict[str, Any] = SMALL, **options: Any) -> Bench:
        made.append(Bench(tmp_path, document, **options))
        return made[-1]

    yield begin
    for bench in made:
        bench.engine.close()


def test_idle_worker_that_dies_is_replaced(make: Make) -> None:
    bench = make()
    worker = bench.worker()
    os.kill(worker, signal.SIGKILL)
    until(lambda: bench.is_replaced(worker))


@pytest.mark.slow
def test_endless_task_fails_alone(make: Make, tmp_path: Path) -> None:
    bench = make(lease=Lease(silent_seconds=1.0, task_seconds=1.0))
    after = bench.tile(1)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "jobs" / "endless").mkdir()
    # Opening it to read waits for a writer, which never comes.
    (tmp_path / "jobs" / "endless" / "spec.json").symlink_to(tmp_path / "pipe")
    endless = replace(bench.tile(0), job="endless", spec_sha256="other")
    bench.submit(endless, after)
    reports = bench.collect(2)
    assert reports[after] == Interrupted()
    failed = reports[endless]
    assert isinstance(failed, TaskFailed)
    assert (failed.code, failed.passes) == ("took_too_long", False)
    assert isinstance(bench.run(after), TileDone)


@pytest.mark.slow
def test_stopped_worker_is_found_by_its_silence(make: Make) -> None:
    bench = make(lease=Lease(silent_seconds=1.0))
    worker = bench.worker()
    os.kill(worker, signal.SIGSTOP)
    task = bench.tile()
    assert bench.run(task) == WorkerDied()
    assert isinstance(bench.run(task), TileDone)
    assert bench.worker() != worker


@pytest.mark.slow
def test_stopped_worker_is_found_behind_a_full_pipe(make: Make) -> None:
    bench = make(lease=Lease(silent_seconds=1.0))
    os.kill(bench.worker(), signal.SIGSTOP)
    many = np.ones((1 << 20, 3))
    assert isinstance(
        bench.run(TraceTask(bench.plan.document, many, many, user="ann")), WorkerDied | Interrupted
    )
    assert isinstance(bench.run(bench.tile()), TileDone)


def test_task_that_needs_too_much_memory_fails_alone(make: Make) -> None:
    bench = make(scene(16384, 16384, samples=1), memory_bytes=2 << 30)
    huge = TileTask("job", bench.spec_sha256, Tile(0, 0, 0, 16384, 16384), bench.plan.passes[-1], attempt=1)
    small = bench.tile()
    bench.submit(huge, small)
    outcomes = bench.collect(2)
    failed = outcomes[huge]
    assert isinstance(failed, TaskFailed)
    assert failed.code == "out_of_memory"
    assert isinstance(outcomes[small], TileDone)


@pytest.mark.slow
def test_worker_killed_within_a_large_answer_is_replaced(make: Make) -> None:
    """Killed at five moments about the end of a task whose answer takes a while to travel."""
    bench = make(scene(128, 64, samples=256, light_samples=64))
    rays = 150_000
    directions = np.tile([[0.0, 0.0, -1.0]], (rays, 1))
    task = TraceTask(bench.plan.document, np.zeros((rays, 3)), directions, user="ann")
    begun = time.monotonic()
    assert isinstance(bench.run(task), CallDone)
    lasted = time.monotonic() - begun
    for share in np.linspace(0.7, 1.0, 5):
        worker = bench.worker()
        bench.submit(task)
        time.sleep(share * lasted)
        os.kill(worker, signal.SIGKILL)
        assert isinstance(bench.collect(1)[task], WorkerDied | CallDone)
        until(partial(bench.is_replaced, worker))
    assert isinstance(bench.run(bench.tile()), TileDone)


@pytest.mark.slow
def test_stopped_fork_server_is_replaced(make: Make) -> None:
    bench = make(lease=Lease(start_seconds=10.0))
    worker = bench.worker()
    (process,) = fork_servers_of(os.getpid())
    os.kill(process, signal.SIGSTOP)
    os.kill(worker, signal.SIGKILL)
    until(lambda: bench.is_replaced(worker), TIMEOUT)
    assert isinstance(bench.run(bench.tile()), TileDone)


def test_engine_closes_with_a_stopped_fork_server(make: Make) -> None:
    bench = make()
    worker = bench.worker()
    (process,) = fork_servers_of(os.getpid())
    os.kill(process, signal.SIGSTOP)
    os.kill(worker, signal.SIGKILL)
    until(lambda: not bench.engine.alive())
    bench.engine.close()
    until(lambda: not is_alive(process))
