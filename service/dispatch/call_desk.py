"""The call desk: the queue of traces, quotes and other calls, and its order.

Calls alternate with tiles. The next call is that of the user with the fewest running ones, and then of the
one with the least worker time since the queue was last empty. Calls are charged to their users' shares of the
workers, as tiles are.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import NamedTuple

from service.errors import BusyError, UnavailableError
from service.workers.tasks import CallTask, Interrupted, Outcome, TaskFailed


class Call(NamedTuple):
    """A call, its answer, and when it was handed out."""

    task: CallTask
    answer: Future[Outcome]
    begun: float = 0.0


class CallDesk:
    """Calls that wait for a worker, and those that workers have.

    `place` and `ask` are for any thread, everything else for the dispatcher's.

    Parameters
    ----------
    most
        Calls of one user at once; more are refused.
    workers
        No user's calls occupy more than half of them: a call may take a minute, and cannot be preempted.
    wake
        Wakes the dispatcher.

    Attributes
    ----------
    charges : dict
        Worker seconds of each user that are not written to the database yet.
    is_next : bool
        Whether a call goes before the waiting tiles: after each call it is the tiles' turn.
    """

    def __init__(self, most: int, workers: int, wake: Callable[[], None]) -> None:
        self._most, self._share, self._wake = most, max(1, workers // 2), wake
        self._lock = threading.Lock()
        self._open: Counter[str] = Counter()
        self._waiting: deque[Call] = deque()
        self._running: dict[CallTask, Call] = {}
        self._used: defaultdict[str, float] = defaultdict(float)
        self.charges: defaultdict[str, float] = defaultdict(float)
        self.is_next = True

    @contextmanager
    def place(self, user: str) -> Iterator[None]:
        """Count a call of a user until the block ends, since preparing its task takes time, too.

        Raises
        ------
        BusyError
            If the user has too many.
        """
        with self._lock:
            if self._open[user] >= self._most:
                message = f"{self._most} of your calls are in progress, the maximum. Wait for one of them."
                raise BusyError(message)
            self._open[user] += 1
        try:
            yield
        finally:
            with self._lock:
                self._open[user] -= 1
                self._open += Counter()

    def ask(self, task: CallTask) -> Future[Outcome]:
        """Have a worker answer a call; cancel the future to stop it."""
        answer: Future[Outcome] = Future()
        answer.add_done_callback(lambda _: self._wake())
        self._waiting.append(Call(task, answer))
        self._wake()
        return answer

    def hand_out(self, room: int) -> Iterable[CallTask]:
        """Hand out the calls whose turn it is, at most ``room``."""
        for _ in range(room):
            call = self._next()
            if call is None:
                return
            self._waiting.remove(call)
            self._running[call.task] = call._replace(begun=time.monotonic())
            self.is_next = False
            yield call.task

    def _next(self) -> Call | None:
        for call in tuple(self._waiting):
            if call.answer.cancelled():
                self._waiting.remove(call)
        running = Counter(task.user for task in self._running)
        if not self._waiting and not running:
            self._used.clear()
        ready = [call for call in tuple(self._waiting) if running[call.task.user] < self._share]
        return min(
            ready, key=lambda call: (running[call.task.user], self._used[call.task.user]), default=None
        )

    def record(self, task: CallTask, outcome: Outcome) -> None:
        """Answer a call with the outcome of its task, and charge its user."""
        call = self._running.pop(task)
        if isinstance(outcome, Interrupted) and not call.answer.cancelled():
            self._waiting.appendleft(call)
            return
        # A call that was stopped, or lost its worker, has not measured its cost.
        passed = time.monotonic() - call.begun
        seconds = getattr(outcome, "cpu_seconds", passed)
        self._used[task.user] += seconds
        self.charges[task.user] += seconds
        if not call.answer.set_running_or_notify_cancel():
            return
        if isinstance(outcome, TaskFailed) and outcome.passes:
            call.answer.set_exception(UnavailableError(outcome.message))
        else:
            call.answer.set_result(outcome)

    def unwanted(self) -> set[CallTask]:
        """Return the running tasks for which nobody waits any more."""
        return {task for task, call in self._running.items() if call.answer.cancelled()}

    def close(self) -> None:
        """Cancel all answers: the service stops."""
        for call in (*self._running.values(), *self._waiting):
            call.answer.cancel()
