"""The engine of one machine: N slots, each a process with a pipe of its own.

A slot loses what its process was given and nothing else, and the process is replaced. The process alone holds
the far end of its pipe: one that dies in the middle of a large answer is an end of file here, where a pool
with a queue would wait for the rest of the answer.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from service.engines.tasks import Interrupted, Outcome, Report, Task, WorkerDied
from service.engines.worker import WorkerSetup, work

# The second task waits here, so that it starts the moment the first one ends.
WINDOW = 2

# Each worker is one thread: the slots are the parallelism.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class SlotEngine:
    """Runs tasks in processes of this machine.

    The thread that calls ``start``, ``room`` and ``submit`` must live as long as the engine: on Linux the
    workers die with the thread that started them.

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
    """One process, the thread that listens to it, and the tasks it was given in the order it runs them.

    Attributes
    ----------
    pid : int or None
        Of the process, from when it says that it has started until it is known to be lost.
    """

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
        self.mend()
        with self._lock:
            self._tasks.append(task)
            if len(self._tasks) == 1 and self.pid is not None:
                self._tell_first()

    def mend(self) -> None:
        if self._dead:
            self._start_process()

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Kill the process if its task is wanted; one that has not started yet runs nothing."""
        with self._lock:
            if self._tasks and self.pid is not None and wanted(self._tasks[0]):
                self._blameless = True
                self._process.kill()

    def close(self) -> None:
        self._report = _nobody
        self._process.kill()
        self._listener.join()

    def _start_process(self) -> None:
        self._blameless = self._dead = False
        context = get_context("spawn")
        self._connection, there = context.Pipe()
        self._process = context.Process(target=work, args=(there, self._setup), daemon=True)
        self._process.start()
        # The process alone holds it now, and it closes with the process.
        there.close()
        self._listener = threading.Thread(
            target=self._listen, args=(self._connection, self._process), daemon=True
        )
        self._listener.start()

    def _listen(self, connection: Connection, process: SpawnProcess) -> None:
        """Report one outcome after another, until the process is lost."""
        with connection:
            try:
                self._started(connection.recv())
                while True:
                    self._ended(connection.recv())
            except (EOFError, OSError):
                self._lost()
        process.join()

    def _started(self, pid: int) -> None:
        with self._lock:
            self.pid = pid
            if self._tasks:
                self._tell_first()

    def _ended(self, outcome: Outcome) -> None:
        with self._lock:
            task = self._tasks.popleft()
            if self._tasks:
                self._tell_first()
        self._report(task, outcome)

    def _tell_first(self) -> None:
        """Give the process, which has nothing to do, the first task."""
        try:
            self._connection.send(self._tasks[0])
        except OSError:
            # It is dead, as the listener will find: no task is to blame.
            self._blameless = True

    def _lost(self) -> None:
        """Report the tasks of a dead process: only the first of them was running when it died."""
        with self._lock:
            blamed, lost = not self._blameless, list(self._tasks)
            self._tasks.clear()
            self.pid, self._dead = None, True
        for number, task in enumerate(lost):
            self._report(task, WorkerDied() if blamed and number == 0 else Interrupted())


def _nobody(_task: Task, _outcome: Outcome, /) -> None:
    """Take reports after the end."""
