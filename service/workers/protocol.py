"""The interface of an engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from service.workers.tasks import Report, Task


class Engine(Protocol):
    """Executes tasks somewhere else. All methods are called by one thread, the dispatcher's."""

    def start(self, report: Report) -> None:
        """Get ready; ``report`` is told the outcome of every task."""

    def room(self) -> int:
        """How many more tasks are taken now without letting any of them wait long."""

    def submit(self, task: Task) -> None:
        """Execute a task. The outcome is reported, never returned or raised."""

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Stop the running tasks that are ``wanted``; they are reported as interrupted."""

    def alive(self) -> bool:
        """Whether a task submitted now would be executed. May be called by any thread."""

    def close(self) -> None:
        """Stop everything at once. Nothing is reported from here on."""
