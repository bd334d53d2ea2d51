"""The tasks of jobs that the dispatcher has handed out, and outcomes that no round has recorded."""

from __future__ import annotations

import time
from collections.abc import Mapping

from schemas.api.jobs import JobState
from service.dispatch.holding import HeldTasks
from service.workers.tasks import JobTask, Outcome, Released


class Flights:
    """Tasks of jobs that the engine has or that are held back. Used only by the dispatcher's thread.

    Attributes
    ----------
    tasks : set
        The tasks whose outcome is expected.
    reports : list
        Outcomes that no round has recorded yet.
    leaving : dict
        Renders that are being stopped, with the time at which their tasks are killed.
    """

    def __init__(self) -> None:
        self.tasks: set[JobTask] = set()
        self.reports: list[tuple[JobTask, Outcome]] = []
        self.leaving: dict[str, float] = {}
        self._held = HeldTasks()
        self._stale: set[JobTask] = set()

    def land(self, task: JobTask, outcome: Outcome) -> bool:
        """Record the outcome of a task; False if it was no longer expected."""
        if task in self._stale:
            self._stale.discard(task)
            return False
        self.tasks.discard(task)
        self.reports.append((task, outcome))
        return True

    def hold(self, task: JobTask, seconds: float) -> None:
        """Keep a task back from the engine for a while."""
        self.tasks.add(task)
        self._held.hold(task, seconds)

    def release(self) -> None:
        """Report the tasks that were held back for long enough, or whose renders are leaving."""
        for task in self._held.release(self.leaving):
            self.land(task, Released())

    def leave(self, render: str, grace: float) -> None:
        """Kill the tasks of a render that has ended, after some seconds."""
        self.leaving.setdefault(render, time.monotonic() + grace)

    def clear(self, ended: Mapping[str, JobState]) -> list[str]:
        """Return the ended renders to which nothing writes any more; the tasks of the others are killed."""
        busy = {task.job for task in self.tasks}
        for render in ended:
            if render in busy:
                self.leave(render, 0.0)
            else:
                self.leaving.pop(render, None)
        return [render for render in ended if render not in busy]

    def forget(self) -> None:
        """Stop all tasks: the database no longer expects their outcomes."""
        self._stale |= self.tasks - self._held.forget()
        self.tasks, self.reports, self.leaving = set(), [], {}

    def are_leaving(self) -> bool:
        """Whether the engine may have tasks that are to be killed, now or soon."""
        return bool(self.leaving or self._stale)

    def unwanted(self) -> set[JobTask]:
        """Return the tasks that are to be killed now."""
        now = time.monotonic()
        late = {render for render, deadline in self.leaving.items() if deadline <= now}
        return self._stale | {task for task in self.tasks if task.job in late}

    def held_seconds(self) -> float | None:
        """Seconds until the next task that is held back is released; None if there is none."""
        return self._held.seconds_left()
