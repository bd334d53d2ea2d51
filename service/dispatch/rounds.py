"""One round of the dispatcher: its decisions, inside one transaction."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import structlog
from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from schemas.api.jobs import Failure, JobState
from service.dispatch import adaptive_passes as adaptive
from service.dispatch import ledger
from service.dispatch.holding import LATE_SECONDS, backoff
from service.dispatch.leadership import LEASE_SECONDS
from service.lifecycle import damage, fairness, rows, sharing
from service.lifecycle.damage import DamagedRenderError, using
from service.storage.database.models import JobRow, RenderRow
from service.workers.tasks import (
    OUT_OF_MEMORY,
    REQUEST_DAMAGED,
    TOOK_TOO_LONG,
    AdvanceDone,
    AdvanceTask,
    Cause,
    ComposeDone,
    ComposeTask,
    InputDamaged,
    Interrupted,
    JobTask,
    Outcome,
    Preempted,
    TaskFailed,
    TileDone,
    TileTask,
    WorkerDied,
    cause_of,
    log_names,
    memory_limit,
)

_SHARING = select(JobRow.id).join(RenderRow).where(RenderRow.id.in_(bindparam("renders", expanding=True)))

T = TypeVar("T")

_OWN_CODES = (OUT_OF_MEMORY, TOOK_TOO_LONG, REQUEST_DAMAGED)
"""Failure codes of tasks that become those of their jobs; others are details."""

NOT_ASSEMBLED = "The picture could not be assembled."


log = structlog.get_logger()


@dataclass
class Round:
    """One round of the dispatcher: its input, and after ``decide`` its decisions.

    These take effect only after the transaction is committed.

    Parameters
    ----------
    reports
        Outcomes since the last round.
    flying
        Tasks that the engine still has.
    leaving
        Renders that are being cancelled.
    room
        Number of tasks that the engine takes.
    idle
        Number of these that begin at once: the others wait at a worker for the end of its task.
    spare
        Number of tasks that begin at once beside overdue ones, of users for whom no tile is rendered.
    max_attempts
        Number of workers that a task may cost.
    worker_bytes
        Memory of a worker.
    begun
        When the service gave its last sign of life, by the monotonic clock.
    """

    reports: Sequence[tuple[JobTask, Outcome]]
    flying: Collection[JobTask]
    leaving: Collection[str]
    room: int
    idle: int
    spare: int
    max_attempts: int
    worker_bytes: int
    begun: float = field(default_factory=time.monotonic)

    touched: set[str] = field(default_factory=set)
    """Renders that have news."""
    news: set[str] = field(default_factory=set)
    """The jobs that have news, those that share in one of these among them."""
    ended: dict[str, JobState] = field(default_factory=dict)
    """Renders that have reached a final state, and which."""
    tasks: list[JobTask] = field(default_factory=list)
    """Tasks for the engine."""
    beside: list[JobTask] = field(default_factory=list)
    """Tasks among these that begin beside overdue ones."""
    deadline_in: float | None = None
    """Seconds until the time limit of some render is spent, and a decision is due."""
    store_closed: bool = False
    """Whether a task could not write to the disk, so that trying again at once is useless."""
    held: list[tuple[JobTask, float]] = field(default_factory=list)
    """Tasks that wait before their next attempt, and for how many seconds."""
    retries: Counter[Cause] = field(default_factory=Counter)
    """Numbers of tasks to retry, by cause."""

    def decide(self, session: Session) -> None:
        """Record reported outcomes, end cancelled renders, hand out the next tasks."""
        for task, outcome in self.reports:
            render = ledger.render_of(session, task.job)
            if render is not None:
                self._past_damage(session, partial(self._land, session, render, task, outcome))
        self._settle(session)
        self._end_late(session)
        session.flush()
        if not self.store_closed:
            self._claim(session)
        self.touched |= {task.job for task in self.tasks}
        session.flush()
        if self.touched:
            self.news |= set(session.scalars(_SHARING, {"renders": list(self.touched)}))

    def _past_damage(self, session: Session, step: Callable[[], T]) -> T | None:
        """Take a step of the round again as long as a damaged render ends it, which fails."""
        while True:
            try:
                return step()
            except DamagedRenderError as damaged:
                render = damaged.render
                damage.note(render.id, damaged.__cause__)
                if not render.state.final:
                    failure = Failure(code="job_damaged", message=str(damaged), retryable=True)
                    rows.end(session, render, JobState.FAILED, failure)
                self.touched.add(render.id)
                self.ended[render.id] = render.state

    def _claim(self, session: Session) -> None:
        self._past_damage(session, partial(self._claim_pictures, session))
        self._past_damage(session, partial(self._claim_tiles, session))

    def _claim_pictures(self, session: Session) -> None:
        busy = (*self.flying, *self.tasks, *(task for task, _ in self.held))
        merging = (task for task in busy if isinstance(task, ComposeTask | AdvanceTask))
        for task in ledger.compose_claims(session, {task.job for task in merging}):
            self.tasks.append(task)

    def _claim_tiles(self, session: Session) -> None:
        # If several users want the workers, no task waits behind one of unknown duration: the next worker is
        # free within a time slice, and goes to the user whose turn it is.
        room = min(self.room, self.idle) if fairness.is_contended(session) else self.room
        for task in ledger.tile_claims(session, max(0, room - len(self.tasks))):
            self.tasks.append(task)
        if self.spare and not self.tasks:
            self.beside += ledger.tile_claims(session, self.spare, ledger.payers(session))
            self.tasks += self.beside

    def may_be_spare(self, task: JobTask) -> bool:
        """Whether a task may begin beside overdue ones: a tile claimed for it, or the end of a pass."""
        return task in self.beside or not isinstance(task, TileTask)

    def _end_late(self, session: Session) -> None:
        if time.monotonic() - self.begun >= LEASE_SECONDS:
            # The process was stopped, or the machine slept, in the middle of this round: the next sign of
            # life shows the outage, before which no time limit is checked.
            self.deadline_in = 0.0
            return
        ended, left, upcoming = sharing.end_late(session)
        for render in ended:
            self.touched.add(render.id)
            self.ended[render.id] = render.state
        self.news |= set(left)
        spent = self._past_damage(session, partial(adaptive.expire, session))
        self.deadline_in = min(filter(None, (upcoming, spent)), default=None)

    def _land(self, session: Session, render: RenderRow, task: JobTask, outcome: Outcome) -> None:
        self.touched.add(render.id)
        if isinstance(outcome, TaskFailed) and outcome.passes:
            self.store_closed = True
        with using(render):
            if isinstance(task, TileTask):
                self._land_tile(session, render, task, outcome)
            else:
                self._land_picture(session, render, task, outcome)
        if render.state.final:
            self.ended[render.id] = render.state

    def _land_tile(self, session: Session, render: RenderRow, task: TileTask, outcome: Outcome) -> None:
        match outcome:
            case TileDone():
                ledger.land(session, render, task, outcome)
            case Preempted():
                ledger.preempt(session, render, task, outcome)
            case TaskFailed(code=code, message=message, passes=False):
                _fail(session, render, code, message, retryable=code == REQUEST_DAMAGED)
            case InputDamaged() if ledger.take_back(session, render, task):
                self._repair(session, render, outcome)
            case Interrupted(late=True) if not adaptive.is_spent(render):
                self._hold(task, LATE_SECONDS, Interrupted())
            case WorkerDied():
                self._land_death(session, render, task, outcome)
            case _ if ledger.take_back(session, render, task):
                self._count_retry(outcome)

    def _land_death(self, session: Session, render: RenderRow, task: TileTask, outcome: WorkerDied) -> None:
        deaths = ledger.note_death(session, render, task)
        if deaths >= self.max_attempts:
            _fail(session, render, "worker_died", self._died(task), retryable=True)
        elif deaths:
            self._hold(task, backoff(deaths), outcome)

    def _died(self, task: TileTask) -> str:
        return (
            f"Tile {task.tile.index} of pass {task.pass_.index} was tried {self.max_attempts} times, and the "
            f"worker died each time. It may have needed more than the {memory_limit(self.worker_bytes)}, or "
            "than the machine has."
        )

    def _hold(self, task: JobTask, seconds: float, outcome: Outcome) -> None:
        self.held.append((task, seconds))
        self._count_retry(outcome)

    def _land_picture(
        self, session: Session, render: RenderRow, task: ComposeTask | AdvanceTask, outcome: Outcome
    ) -> None:
        if _is_stale(render, task):
            return
        render.compose_deaths += isinstance(outcome, WorkerDied)
        match outcome:
            case ComposeDone() if isinstance(task, ComposeTask):
                ledger.complete(session, render, task, outcome)
            case AdvanceDone() if isinstance(task, AdvanceTask):
                adaptive.merge(session, render, task, outcome)
            case TaskFailed(code=code, message=message) if code in _OWN_CODES:
                _fail(session, render, code, message, retryable=code == REQUEST_DAMAGED)
            case TaskFailed(passes=False):
                _fail(session, render, "storage_failed", NOT_ASSEMBLED, retryable=True)
            case InputDamaged():
                self._repair(session, render, outcome)
            case WorkerDied() if render.compose_deaths >= self.max_attempts:
                _fail(session, render, "worker_died", NOT_ASSEMBLED, retryable=True)
            case WorkerDied():
                self._hold(task, backoff(render.compose_deaths), outcome)
            case TaskFailed() | Interrupted():
                self._count_retry(outcome)

    def _repair(self, session: Session, render: RenderRow, damaged: InputDamaged) -> None:
        if ledger.repair(session, render, damaged, self.max_attempts):
            self._count_retry(damaged)
        else:
            _fail(session, render, "storage_failed", NOT_ASSEMBLED, retryable=True)

    def _count_retry(self, outcome: Outcome) -> None:
        cause = cause_of(outcome)
        if cause is not None:
            self.retries[cause] += 1

    def _settle(self, session: Session) -> None:
        """End the cancelled renders that have no task left with the engine."""
        busy = {task.job for task in self.flying}
        for render_id in set(self.leaving) - busy:
            render = ledger.render_of(session, render_id)
            if render is not None and not render.state.final:
                rows.end(session, render, JobState.CANCELLED)
            self.touched.add(render_id)
            self.ended[render_id] = render.state if render else JobState.CANCELLED


def _is_stale(render: RenderRow, task: ComposeTask | AdvanceTask) -> bool:
    """Whether the outcome of a task is no longer expected, and has no effect."""
    if isinstance(task, AdvanceTask) and task.pass_.index != len(render.merges):
        # Reported again after a transaction with an unknown result.
        return True
    return _ends(render) or task.attempt != render.compose_attempt


def _ends(render: RenderRow) -> bool:
    """Whether no job waits for a render any more."""
    return render.state.final or render.cancel_requested


def _fail(session: Session, render: RenderRow, code: str, message: str, *, retryable: bool) -> None:
    if not _ends(render):
        rows.end(session, render, JobState.FAILED, Failure(code=code, message=message, retryable=retryable))


def log_report(task: JobTask, outcome: Outcome) -> None:
    """Log the outcome of a task."""
    details = log_names(task)
    if isinstance(outcome, WorkerDied):
        log.warning("worker died", **details)
    elif isinstance(outcome, TaskFailed):
        log.warning("task failed", code=outcome.code, **details)
    elif isinstance(outcome, InputDamaged):
        log.error("stored files damaged", steps=outcome.steps, merged=outcome.merged, **details)
    else:
        log.debug("task done", outcome=type(outcome).__name__, **details)
