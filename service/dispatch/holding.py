"""Tiles that a worker has given up as late while their job has time left, by the server's clock.

A worker that measured otherwise would give each up again at once, thousands of times until the job ends.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator

from service.workers.tasks import JobTask

HOLD_SECONDS = 1.0
"""How long a tile is held before it may be handed out again: a fraction of the shortest useful time limit."""


class HeldTasks:
    """Tasks that are held back, in the order in which they are released.

    Parameters
    ----------
    clock
        Seconds from some beginning.

    Examples
    --------
    >>> HeldTasks().seconds_left() is None
    True
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._tasks: deque[tuple[float, JobTask]] = deque()

    def hold(self, task: JobTask) -> None:
        """Hold a task back from now on."""
        self._tasks.append((self._clock() + HOLD_SECONDS, task))

    def release(self) -> Iterator[JobTask]:
        """Return the tasks that were held long enough, and hold them no longer."""
        while self._tasks and self._tasks[0][0] <= self._clock():
            yield self._tasks.popleft()[1]

    def seconds_left(self) -> float | None:
        """Seconds until the next task is released; None if there is none."""
        return self._tasks[0][0] - self._clock() if self._tasks else None

    def forget(self) -> set[JobTask]:
        """Hold nothing any more, and return what was held."""
        held = {task for _, task in self._tasks}
        self._tasks.clear()
        return held
