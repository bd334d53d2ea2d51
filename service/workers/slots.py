"""The engine of one machine: N slots, each a process with a pipe of its own.

A slot loses what its process was given and nothing else, and the process is replaced. The process alone holds
the far end of its pipe: one that dies in the middle of a large answer is an end of file here, where a pool
with a queue would wait for the rest of the answer.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from service.workers.slot import Slot
from service.workers.tasks import Report, Task
from service.workers.worker import WorkerSetup

# The second task waits here, so that it starts the moment the first one ends.
WINDOW = 2

# Each worker is one thread: the slots are the parallelism.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class SlotEngine:
    """Runs tasks in processes of this machine.

    Parameters
    ----------
    workers : int
        Number of slots.
    setup : WorkerSetup
        What every worker process is told.
    """

    def __init__(self, workers: int, setup: WorkerSetup) -> None:
        self._slots = [Slot(setup) for _ in range(workers)]

    def start(self, report: Report) -> None:
        """Start all worker processes; they import the renderer while the caller goes on."""
        for name in ONE_THREAD:
            os.environ[name] = "1"
        for slot in self._slots:
            slot.start(report)

    def room(self) -> int:
        """How many more tasks are taken now."""
        return sum(WINDOW - slot.load() for slot in self._slots)

    def submit(self, task: Task) -> None:
        """Give a task to the slot with the fewest."""
        min(self._slots, key=Slot.load).submit(task)

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
            slot.kill()
        for slot in self._slots:
            slot.join()
