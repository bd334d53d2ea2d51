"""States of workers, for people who look after a service."""

from __future__ import annotations

from typing import NamedTuple

from service.workers.tasks import Task


class WorkerState(NamedTuple):
    """State of a worker.

    ``name`` is the number of its slot, or its address in a cluster, where its ``pid`` is not known. It has
    been at ``task`` for so many ``seconds``; None if it has nothing to do.
    """

    name: str
    pid: int | None
    task: Task | None
    seconds: float
