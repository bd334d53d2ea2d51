"""Tasks that wait before their next attempt, because an immediate one would probably end like the last.

Tasks that killed a worker wait longer each time. A tile that its worker gave up as late, while its job has
time left by the server's clock, would be given up thousands of times until the job ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator

from service.workers.tasks import JobTask

LATE_SECONDS = 1.0
"""Seconds that a late tile is held: a fraction of the shortest useful time limit."""
# Memory that other processes of the machine have used up is often free again within seconds.
BACKOFF_SECONDS, BACKOFF_FACTOR, MAX_BACKOFF_SECONDS = 0.5, 4.0, 30.0


def backoff(deaths: int) -> float:
    """Return the seconds that a task is held for after this number of worker deaths.

    >>> [backoff(deaths) for deaths in range(1, 5)]
    [0.5, 2.0, 8.0, 30.0]
    """
    return min(BACKOFF_SECONDS * BACKOFF_FACTOR ** min(deaths - 1, 16), MAX_BACKOFF_SECONDS)


class HeldTasks:
    """Tasks that are held back, each for a time of its own.

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
        self._until: dict[JobTask, float] = {}

    def hold(self, task: JobTask, seconds: float) -> None:
        """Hold a task back from now on."""
        self._until[task] = self._clock() + seconds

    def release(self, leaving: Collection[str] = ()) -> Iterator[JobTask]:
        """Return the tasks that were held long enough, or whose renders are leaving; hold them no longer."""
        now = self._clock()
        for task, until in [*self._until.items()]:
            if until <= now or task.job in leaving:
                del self._until[task]
                yield task

    def seconds_left(self) -> float | None:
        """Seconds until the next task is released; None if there is none."""
        return min(self._until.values()) - self._clock() if self._until else None

    def forget(self) -> set[JobTask]:
        """Release all tasks, and return them."""
        held = set(self._until)
        self._until.clear()
        return held
