"""Why tasks are tried again."""

from __future__ import annotations

from enum import StrEnum

from service.workers.tasks import (
    STORAGE_AWAY,
    STORAGE_FULL,
    STORAGE_READ_ONLY,
    Interrupted,
    Outcome,
    TaskFailed,
    WorkerDied,
)


class Cause(StrEnum):
    """What was in the way of a task."""

    WORKER_DIED = "worker_died"
    INTERRUPTED = "interrupted"
    STORAGE_FULL = STORAGE_FULL
    STORAGE_READ_ONLY = STORAGE_READ_ONLY
    STORAGE_AWAY = STORAGE_AWAY
    SERVER_LOST = "server_lost"
    DATABASE_LOST = "database_lost"


def cause_of(outcome: Outcome) -> Cause | None:
    """Give what was in the way of a task that is taken back; None where nothing was, but time was up.

    Raises
    ------
    ValueError
        If the outcome is not one after which a task is tried again.
    """
    match outcome:
        case WorkerDied():
            return Cause.WORKER_DIED
        case Interrupted(late=late):
            return None if late else Cause.INTERRUPTED
        case TaskFailed(code=code):
            return Cause(code)
        case _:
            raise ValueError(outcome)
