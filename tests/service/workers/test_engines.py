"""The contract of all engines: they run tasks, survive crashes, and give tasks back on request."""

import json
import os
import queue
import signal
import threading
from collections.abc import Iterator

import numpy as np
import psutil
import pytest

import renderer
from service.storage.tiles import StoredTile
from service.workers.states import WorkerState
from service.workers.tasks import (
    CallDone,
    Interrupted,
    Outcome,
    Task,
    TaskFailed,
    TileDone,
    TraceTask,
    WorkerDied,
)
from tests.service.support import TIMEOUT, until
from tests.service.workers.bench import Bench


@pytest.fixture(scope="module", params=["slots", pytest.param("dask", marks=pytest.mark.slow)])
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    made = Bench(tmp_path_factory.mktemp("engine"), kind=request.param)
    yield made
    # The last test has closed it, if it was run.
    if made.engine.room() > 0:
        made.engine.close()


def rays(bench: Bench, origins: int = 1) -> TraceTask:
    return TraceTask(bench.plan.document, np.zeros((origins, 3)), np.ones((1, 3)), user="ann")


def interrupted(bench: Bench, task: Task, count: int = 1) -> dict[Task, Outcome]:
    """Ask for a task until everything is reported, as the dispatcher does."""
    reports: dict[Task, Outcome] = {}
    while len(reports) < count:
        bench.engine.interrupt(lambda found: found is task)
        try:
            reports |= [bench.reports.get(timeout=0.05)]
        except queue.Empty:
            continue
    return reports


@pytest.mark.slow
def test_tile_is_stored_before_it_is_reported(bench: Bench) -> None:
    task = bench.tile()
    done = bench.run(task)
    assert isinstance(done, TileDone)
    stored = bench.store.get_tile("job", StoredTile(task.tile, task.pass_, 1, done.crc32))
    assert stored.tobytes() == renderer.render_tile(bench.plan, task.tile, task.pass_).pixels.tobytes()


def test_answer_comes_back_unchanged(bench: Bench) -> None:
    done = bench.run(rays(bench))
    assert isinstance(done, CallDone)
    expected = renderer.trace(bench.plan, np.zeros((1, 3)), np.ones((1, 3)))
    assert json.loads(done.answer)["t"] == expected.t.tolist()


def test_error_comes_back_with_its_code(bench: Bench) -> None:
    failed = bench.run(rays(bench, origins=2))
    assert isinstance(failed, TaskFailed)
    assert failed.code == "render_failed"


def test_task_that_cannot_be_sent_fails_alone(bench: Bench) -> None:
    task = TraceTask(bench.plan.document, threading.Lock(), np.ones((1, 3)), user="ann")  # type: ignore[arg-type]
    assert isinstance(bench.run(task), TaskFailed)
    assert isinstance(bench.run(rays(bench)), CallDone)


def test_room_is_for_a_few_tasks(bench: Bench) -> None:
    room = bench.engine.room()
    assert 2 <= room <= 4
    tasks = [rays(bench) for _ in range(room)]
    bench.submit(*tasks)
    assert bench.engine.room() < room
    assert bench.collect(room).keys() == set(tasks)
    assert bench.engine.room() == room


def test_workers_say_what_they_are_at(bench: Bench) -> None:
    def state() -> WorkerState:
        [found] = bench.engine.workers()
        return found

    assert state().task is None
    task = bench.tile()
    bench.submit(task)
    until(lambda: state().task is task and state().seconds > 0)
    bench.collect(1)
    until(lambda: state().task is None)


def test_crash_is_blamed_on_the_running_task(bench: Bench) -> None:
    worker = bench.worker()
    first, second = bench.tile(0), bench.tile(1)
    at_work = bench.working(worker)
    bench.submit(first, second)
    until(at_work)
    os.kill(worker, signal.SIGKILL)
    reports = bench.collect(2)
    assert reports[first] == WorkerDied()
    assert isinstance(reports[second], TileDone | Interrupted)
    until(lambda: bench.worker() != worker)
    assert isinstance(bench.run(rays(bench)), CallDone)


def test_interrupted_task_is_not_blamed(bench: Bench) -> None:
    worker, task = bench.worker(), bench.tile()
    at_work = bench.working(worker)
    bench.submit(task)
    until(at_work)
    assert interrupted(bench, task) == {task: Interrupted()}
    until(lambda: worker not in bench.workers())


def test_waiting_task_is_interrupted_alone(bench: Bench) -> None:
    bench.worker()
    running, waiting = bench.tile(0), bench.tile(1)
    bench.submit(running, waiting)
    reports = interrupted(bench, waiting, 2)
    assert isinstance(reports[running], TileDone)
    assert reports[waiting] == Interrupted()


def test_closed_engine_leaves_no_worker(bench: Bench) -> None:
    bench.submit(bench.tile())
    worker = psutil.Process(bench.worker())
    bench.engine.close()
    until(lambda: not worker.is_running() or worker.status() == psutil.STATUS_ZOMBIE, TIMEOUT)
    assert bench.reports.empty()
