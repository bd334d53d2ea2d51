"""What one round of the dispatcher decides, inside one transaction."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from datetime import datetime

from sqlalchemy.orm import Session

from schemas.jobs import Failure, JobState
from service import ledger, rows, targets
from service.database.models import JobRow
from service.engines.tasks import (
    AdvanceDone,
    AdvanceTask,
    ComposeDone,
    ComposeTask,
    JobTask,
    Outcome,
    TaskFailed,
    TileDone,
    TileTask,
    WorkerDied,
)


@dataclass
class Round:
    """One round: what came in, and after ``decide`` what follows from it.

    Nothing of it may be acted upon before the transaction is committed, and nothing at all if it is not.

    Parameters
    ----------
    reports
        Outcomes since the last round.
    flying
        Tasks that the engine still has.
    leaving
        Jobs that are being cancelled.
    room
        How many tasks the engine takes.
    max_attempts
        How many workers a task may cost.
    """

    reports: Sequence[tuple[JobTask, Outcome]]
    flying: Collection[JobTask]
    leaving: Collection[str]
    room: int
    max_attempts: int

    touched: set[str] = field(default_factory=set)
    """Jobs that have news."""
    ended: dict[str, JobState] = field(default_factory=dict)
    """Jobs that have reached a final state, and which."""
    tasks: list[JobTask] = field(default_factory=list)
    """What to give to the engine."""
    next_deadline: datetime | None = None
    """When the time of some job will be spent, so that there is something to decide."""
    storage_full: bool = False
    """Whether a task found no room on the disk, so that there is no use in trying at once."""

    def decide(self, session: Session) -> None:
        """Land what was reported, end what was cancelled, hand out what is next."""
        for task, outcome in self.reports:
            job = ledger.job_of(session, task.job)
            if job is not None:
                self._land(session, job, task, outcome)
        self._settle(session)
        self.next_deadline = targets.expire(session)
        session.flush()
        if self.storage_full:
            return
        composing = {task.job for task in self.flying if isinstance(task, ComposeTask | AdvanceTask)}
        self.tasks += ledger.compose_claims(session, composing)
        self.tasks += ledger.tile_claims(session, max(0, self.room - len(self.tasks)))
        self.touched |= {task.job for task in self.tasks}

    def _land(self, session: Session, job: JobRow, task: JobTask, outcome: Outcome) -> None:
        self.touched.add(job.id)
        if isinstance(outcome, TaskFailed) and outcome.code == "storage_full":
            self.storage_full = True
        if isinstance(task, TileTask):
            self._land_tile(session, job, task, outcome)
        else:
            self._land_picture(session, job, task, outcome)
        if job.state.final:
            self.ended[job.id] = job.state

    def _land_tile(self, session: Session, job: JobRow, task: TileTask, outcome: Outcome) -> None:
        match outcome:
            case TileDone():
                ledger.land(session, job, task, outcome)
            case TaskFailed(code=code, message=message) if code != "storage_full":
                _fail(job, code, message, retryable=False)
            case WorkerDied():
                if ledger.take_back(session, job, task, death=True) >= self.max_attempts:
                    _fail(job, "worker_died", _died(self.max_attempts, task), retryable=True)
            case _:
                ledger.take_back(session, job, task, death=False)

    def _land_picture(
        self, session: Session, job: JobRow, task: ComposeTask | AdvanceTask, outcome: Outcome
    ) -> None:
        match outcome:
            case ComposeDone() if not job.cancel_requested:
                ledger.complete(job, outcome)
            case AdvanceDone() if isinstance(task, AdvanceTask):
                targets.merge(session, job, task, outcome)
            case TaskFailed(code=code) if code != "storage_full":
                _fail(job, "storage_failed", "The picture could not be put together.", retryable=True)
            case WorkerDied() if task.attempt >= self.max_attempts:
                _fail(job, "worker_died", "The picture could not be put together.", retryable=True)

    def _settle(self, session: Session) -> None:
        """End the cancelled jobs that have no task left with the engine."""
        busy = {task.job for task in self.flying}
        for job_id in set(self.leaving) - busy:
            job = ledger.job_of(session, job_id)
            if job is not None and not job.state.final:
                rows.end(job, JobState.CANCELLED)
            self.touched.add(job_id)
            self.ended[job_id] = job.state if job else JobState.CANCELLED


def _fail(job: JobRow, code: str, message: str, *, retryable: bool) -> None:
    if not job.state.final and not job.cancel_requested:
        rows.end(job, JobState.FAILED, Failure(code=code, message=message, retryable=retryable))


def _died(attempts: int, task: TileTask) -> str:
    return (
        f"Tile {task.tile.index} of pass {task.pass_.index} was tried {attempts} times, "
        "and the worker died each time."
    )
