"""The engine of one machine: N slots, each a pool of one process.

One pool of N processes would lose every waiting task when one of its processes dies. A pool of one
loses what that process was given and nothing else, and is replaced.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, wait
from functools import partial
from multiprocessing import active_children, get_context

from service.engines.tasks import Interrupted, Outcome, Report, Task, WorkerDied
from service.engines.worker import WorkerSetup, execute, start_worker

# The second task waits in the process itself, so that it starts the moment the first one ends.
WINDOW = 2

# Each worker is one thread: the slots are the parallelism.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class SlotEngine:
    """Runs tasks in processes of this machine.

    The thread that calls ``start`` and ``submit`` must live as long as the engine: on Linux the workers
    die with the thread that started them.

    Parameters
    ----------
    workers : int
        Number of slots.
    setup : WorkerSetup
        What every worker process is told.
    """

    def __init__(self, workers: int, setup: WorkerSetup) -> None:
        self._slots = [_Slot(setup) for _ in range(workers)]

    def start(self, report: Report) -> None:
        """Start all worker processes; they import the renderer while the caller goes on."""
        for name in ONE_THREAD:
            os.environ[name] = "1"
        for slot in self._slots:
            slot.start(report)

    def room(self) -> int:
        """How many more tasks are taken now. Dead workers are replaced first."""
        for slot in self._slots:
            slot.mend()
        return sum(WINDOW - slot.load() for slot in self._slots)

    def submit(self, task: Task) -> None:
        """Give a task to the slot with the fewest."""
        min(self._slots, key=_Slot.load).submit(task)

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Kill the workers whose running task is ``wanted``."""
        for slot in self._slots:
            slot.interrupt(wanted)

    def alive(self) -> bool:
        """Whether any worker process has started and none of them is known to be lost."""
        return any(slot.pid is not None for slot in self._slots)

    def close(self) -> None:
        """Kill all workers."""
        for slot in self._slots:
            slot.close()


class _Slot:
    """One pool of one process, and the tasks it was given, in the order in which it runs them."""

    def __init__(self, setup: WorkerSetup) -> None:
        self._setup = setup
        self._lock = threading.Lock()
        self._tasks: deque[Task] = deque()
        self.pid: int | None = None

    def start(self, report: Report) -> None:
        self._report = report
        self._start_process()

    def load(self) -> int:
        return len(self._tasks)

    def submit(self, task: Task) -> None:
        with self._lock:
            self._tasks.append(task)
        try:
            future = self._pool.submit(execute, task)
        except BrokenExecutor:
            # It died while it had nothing to do, and nobody was told.
            self._replace()
            future = self._pool.submit(execute, task)
        future.add_done_callback(partial(self._ended, self._pool, task))

    def mend(self) -> None:
        if self._dead:
            self._replace()

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        with self._lock:
            running = self._tasks[0] if self._tasks else None
        if running is not None and wanted(running):
            self._kill()

    def close(self) -> None:
        self._report = _nobody
        wait((self._hello,))
        self._kill()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _replace(self) -> None:
        self._pool.shutdown(wait=False)
        self._start_process()

    def _start_process(self) -> None:
        self._blameless = self._dead = False
        self.pid = None
        self._pool = ProcessPoolExecutor(1, get_context("spawn"), start_worker, (self._setup,))
        self._hello = self._pool.submit(os.getpid)
        self._hello.add_done_callback(self._started)

    def _started(self, hello: Future[int]) -> None:
        if hello.exception() is None:
            self.pid = hello.result()

    def _kill(self) -> None:
        """Kill the process; one that has not started yet runs nothing, and is left alone."""
        for child in active_children():
            if child.pid == self.pid:
                self._blameless = True
                child.kill()

    def _ended(self, pool: ProcessPoolExecutor, task: Task, future: Future[Outcome]) -> None:
        """Report a task. The pool's own thread calls this, for the tasks of a dead process in their order."""
        with self._lock:
            current = pool is self._pool
            first = current and self._tasks[0] is task and not self._blameless
            self._tasks.remove(task)
            if future.cancelled():
                outcome: Outcome = Interrupted()
            elif isinstance(future.exception(), BrokenExecutor):
                # Only the first of them was running when the process died.
                outcome = WorkerDied() if first else Interrupted()
                self._blameless = self._dead = current
            else:
                outcome = future.result()
        self._report(task, outcome)


def _nobody(_task: Task, _outcome: Outcome, /) -> None:
    """Take reports after the end."""
