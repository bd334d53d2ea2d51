"""The engine for one machine: N slots, each a process with its own pipe.

If a process dies, its slot loses only its tasks, and the process is replaced. The process alone holds the far
end of its pipe, so its death in the middle of a large answer is an end of file, while a pool with a queue
would wait for the rest of the answer.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import structlog

from service.supervision import SupervisedThread
from service.workers.fork_server import fork_server
from service.workers.heartbeats import beats
from service.workers.states import WorkerState
from service.workers.tasks import (
    TOOK_TOO_LONG,
    CallTask,
    Interrupted,
    Outcome,
    Report,
    Task,
    TaskFailed,
    WorkerDied,
    after,
    log_names,
)
from service.workers.worker import WorkerSetup

# The second task waits here, so that it starts as soon as the first one ends.
TASKS_PER_SLOT = 2
# A task is overdue after so many time slices: it cannot be preempted, as where thousands of shapes are in one
# place, or a plan is made. Then the cores are shared with one more process, for other users.
OVERDUE_SLICES = 2


class SlotEngine:
    """Runs tasks in processes of this machine.

    Parameters
    ----------
    workers : int
        Number of slots.
    setup : WorkerSetup
        Settings of every worker process.
    """

    def __init__(self, workers: int, setup: WorkerSetup) -> None:
        self._slots = [Slot(setup) for _ in range(workers)]
        self._spare = Slot(setup)

    def start(self, report: Report) -> None:
        """Start all worker processes but the spare one."""
        self._report = report
        for slot in self._slots:
            slot.start(report)

    def room(self) -> int:
        """Number of tasks that can be submitted now."""
        return sum(TASKS_PER_SLOT - slot.load() for slot in self._slots)

    def idle(self) -> int:
        """Number of idle slots."""
        return sum(slot.load() == 0 for slot in self._slots)

    def spare(self) -> int:
        """1 while all slots are overdue and the spare one is idle; it starts with its first task."""
        return int(not self._spare.load() and all(slot.is_overdue() for slot in self._slots))

    def submit(self, task: Task, *, spare: bool = False) -> None:
        """Give a task to the slot with the fewest, or to the spare one."""
        if spare and self.spare():
            self._spare.start_once(self._report)
            self._spare.submit(task)
        else:
            min(self._slots, key=Slot.load).submit(task)

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Kill the workers whose running task is ``wanted``."""
        for slot in (*self._slots, self._spare):
            slot.interrupt(wanted)

    def workers(self) -> list[WorkerState]:
        """States of the slots, the spare one last if it has begun."""
        slots = [*self._slots, *([self._spare] if self._spare.pid is not None else [])]
        return [slot.state(str(number)) for number, slot in enumerate(slots, 1)]

    def alive(self) -> bool:
        """Whether any worker process has started and none of them is known to be lost."""
        return any(slot.pid is not None for slot in self._slots)

    def close(self) -> None:
        """Kill all workers, also those that have not started yet."""
        for slot in (*self._slots, self._spare):
            slot.kill()
        fork_server.kill()
        for slot in (*self._slots, self._spare):
            slot.join()


# A process that could not even start is not replaced sooner than this, seconds.
PAUSE_SECONDS = 1.0

log = structlog.get_logger()


class Slot:
    """One process, the thread that listens to it, and the tasks it was given in the order it runs them.

    The thread also has the process started, and lives until the slot is closed: on Linux a fork server dies
    with the thread that has started it.

    Attributes
    ----------
    pid : int or None
        Of the process, from when it says that it has started until it is known to be lost.
    """

    def __init__(self, setup: WorkerSetup) -> None:
        self._setup, self._lease = setup, setup.lease
        self._lock = threading.Lock()
        self._tasks: deque[Task] = deque()
        self._came: dict[Task, float] = {}
        self._begun = 0.0
        self._verdict: tuple[Task, Outcome] | None = None
        self._thread = SupervisedThread("slot", self._run)
        self.pid: int | None = None

    def start(self, report: Report) -> None:
        """Start the thread, which starts the process and reports outcomes."""
        self._report = report
        self._thread.start()

    def start_once(self, report: Report) -> None:
        """Start unless that was done before."""
        if not self._thread.is_alive():
            self.start(report)

    def is_overdue(self) -> bool:
        """Whether the process runs a task that is far beyond its time slice."""
        limit = OVERDUE_SLICES * self._lease.slice_seconds
        return self._first() is not None and time.monotonic() - self._begun > limit

    def load(self) -> int:
        """Number of tasks that run or wait here, counting as many as fit where a call runs.

        A tile that waited behind it could wait for a minute, while another slot is free.
        """
        tasks = tuple(self._tasks)
        return TASKS_PER_SLOT if any(isinstance(task, CallTask) for task in tasks) else len(tasks)

    def state(self, name: str) -> WorkerState:
        """State of the process, under a name of the slot."""
        task = self._first()
        return WorkerState(name, self.pid, task, time.monotonic() - self._begun if task else 0.0)

    def submit(self, task: Task) -> None:
        """Queue a task behind those that the slot has."""
        with self._lock:
            self._came[task] = time.monotonic()
            self._tasks.append(task)
            if len(self._tasks) == 1 and self.pid is not None:
                self._send_first()

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Kill the process if its task is wanted; one that has not started yet runs nothing."""
        with self._lock:
            if self._tasks and self.pid is not None and wanted(self._tasks[0]):
                self._end_first(Interrupted())

    def kill(self) -> None:
        """Kill the process, for the last time; nothing is reported from here on."""
        with self._lock:
            self._report = _drop_report
            self._thread.stopping.set()
            self._kill()

    def join(self) -> None:
        """Wait until the process is gone, after `kill`."""
        self._thread.stop()

    def _run(self) -> None:
        while not self._thread.stopping.is_set():
            if not self._serve():
                self._thread.stopping.wait(PAUSE_SECONDS)

    def _serve(self) -> bool:
        """Have one process run tasks, until it is lost; False if it has never started."""
        try:
            return self._listen(self._start_process())
        except Exception:
            # Perhaps there are too many open files; the tasks go to another slot.
            self._lost()
            raise

    def _start_process(self) -> Connection:
        """Fork a process, and return this end of its pipe."""
        self._connection, there = Pipe()
        pulse, beating = Pipe(duplex=False)
        # Afterwards only the process holds these, so that they close with it.
        with there, beating:
            try:
                fork_server.fork(self._setup, there, beating)
            except OSError as error:
                log.warning("worker not started", error=str(error))
        SupervisedThread("watch", partial(self._watch_or_kill, pulse)).start()
        return self._connection

    def _listen(self, connection: Connection) -> bool:
        """Report one outcome after another, until the process is lost; False if it has never started."""
        started = False
        with connection:
            try:
                self._started(connection.recv())
                started = True
                self._thread.note_success()
                while True:
                    self._ended(connection.recv())
            except (EOFError, OSError):
                return started
            finally:
                # Before the pipe is closed, since another thread may be sending a task.
                self._lost()

    def _watch_or_kill(self, pulse: Connection) -> None:
        try:
            self._watch(pulse)
        except Exception:
            # An unwatched process could hang for ever.
            self._kill()
            raise

    def _watch(self, pulse: Connection) -> None:
        """Kill the process after too long a silence, or too long a task.

        It must not wait for the lock, which is held while a task is sent to a suspended process.
        """
        task, spent = None, 0.0
        for passed in beats(pulse, self._lease.beat_seconds):
            first = self._first()
            spent, task = (spent + passed.seconds if first is task else 0.0), first
            if passed.silent >= self._silence_limit():
                log.warning("worker silent", process=self.pid, seconds=passed.silent, **log_names(task))
                if not self._kill():
                    # It was not even forked, so the fork server is dead.
                    fork_server.kill()
            elif task is not None and spent > self._lease.task_seconds:
                self._end_late(task)

    def _silence_limit(self) -> float:
        return self._lease.start_seconds if self.pid is None else self._lease.silent_seconds

    def _first(self) -> Task | None:
        """The running task."""
        try:
            return None if self.pid is None else self._tasks[0]
        except IndexError:
            return None

    def _end_late(self, task: Task) -> None:
        with self._lock:
            if self._first() is task and self._verdict is None:
                self._end_first(TaskFailed(TOOK_TOO_LONG, _too_long(self._lease.task_seconds)))

    def _started(self, pid: int) -> None:
        with self._lock:
            self.pid = pid
            if self._thread.stopping.is_set():
                self._kill()
            elif self._tasks:
                self._send_first()

    def _ended(self, outcome: Outcome) -> None:
        with self._lock:
            task = self._tasks.popleft()
            if self._tasks:
                self._send_first()
        self._report(task, outcome)

    def _send_first(self) -> None:
        """Send the first task to the idle process."""
        first, self._begun = self._tasks[0], time.monotonic()
        try:
            self._connection.send(after(first, time.monotonic() - self._came.pop(first)))
        except OSError:
            # It is dead, which the listener will notice; no task is to blame.
            self._verdict = first, Interrupted()
        except Exception as error:  # noqa: BLE001  (such as MemoryError: another task may be smaller)
            reason = f"The task could not be sent to its worker: {type(error).__name__}."
            self._end_first(TaskFailed("render_failed", reason))

    def _end_first(self, outcome: Outcome) -> None:
        """Kill the process during its first task, and set the outcome to report."""
        self._verdict = self._tasks[0], outcome
        self._kill()

    def _kill(self) -> bool:
        """Kill the process, if it has started."""
        pid = self.pid
        if pid is None:
            return False
        # The number is forgotten as its pipe ends, long before the system gives it to another process.
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        return True

    def _lost(self) -> None:
        """Report the tasks of a dead process: only the first of them was running when it died."""
        with self._lock:
            verdict, lost = self._verdict, list(self._tasks)
            ran = self.pid is not None
            self._verdict = None
            self._tasks.clear()
            self._came.clear()
            self.pid = None
        for number, task in enumerate(lost):
            self._report(task, _became_of(task, verdict) if ran and number == 0 else Interrupted())


def _became_of(task: Task, verdict: tuple[Task, Outcome] | None) -> Outcome:
    """Report the outcome of a task whose process is dead, after a verdict on it or on the one before."""
    if verdict is None:
        return WorkerDied()
    judged, outcome = verdict
    return outcome if judged is task else Interrupted()


def _too_long(seconds: float) -> str:
    return (
        f"A worker was stopped after {seconds:g} seconds at one tile or one answer. Ask for fewer samples or "
        "a smaller picture; operators set 'max_task_seconds'."
    )


def _drop_report(_task: Task, _outcome: Outcome, /) -> None:
    """Take reports after the end."""
