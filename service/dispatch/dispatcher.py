"""The one thread that hands out work and records its outcome.

It sleeps until something happens: a job arrives, a task ends, a job is cancelled. Then one round writes all
results and claims in one transaction, gives the claimed tasks to the engine, and notifies the watchers.

Of several servers on one database that of the leader works on jobs; the others answer calls alone.
"""

from __future__ import annotations

import queue
import time
from collections import Counter, deque
from collections.abc import Mapping
from concurrent.futures import Future
from functools import partial

import structlog
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.dispatch import ledger
from service.dispatch.holding import HeldTasks
from service.dispatch.job_events import JobEvents
from service.dispatch.leadership import BEAT_SECONDS, Leadership, Term
from service.dispatch.orphans import remove_orphans
from service.dispatch.outages import Outages
from service.dispatch.rounds import Round, log_report
from service.dispatch.throughput import Throughput
from service.errors import UnavailableError
from service.lifecycle import damage, sharing
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.tiles import TileStore
from service.supervision import SupervisedThread
from service.telemetry.metrics import Metrics
from service.telemetry.spans import JobSpans
from service.workers.engines import Engine
from service.workers.tasks import (
    CallTask,
    Cause,
    Interrupted,
    JobTask,
    Outcome,
    Released,
    Task,
    TaskFailed,
)

# Seconds before the next try after an error of the database or a full disk.
RETRY_SECONDS = 1.0
# Seconds between checks whether a running task of a render that has ended is gone.
LEAVING_SECONDS = 0.05
# Seconds between checks for free workers while an engine has none: they may come back.
EMPTY_SECONDS = 1.0
# Most traces, quotes and other calls that wait for a worker; more are refused.
MAX_CALLS = 64
# Errors in a row, but for those of the database, before the process ends: the last after 8 seconds of waits.
MOST_FAILURES = 5

log = structlog.get_logger()


class Dispatcher:
    """Keeps the engine busy with the jobs in the database.

    Parameters
    ----------
    database, store, engine, job_events
        The database is the only truth; the engine may lose anything at any time.
    settings : Settings
        Attempts and grace.
    spans
        Record what was handed out and its outcome.
    """

    def __init__(
        self,
        database: Database,
        store: TileStore,
        engine: Engine,
        job_events: JobEvents,
        settings: Settings,
        spans: JobSpans,
    ) -> None:
        self._database, self._store, self._engine, self._job_events = database, store, engine, job_events
        self._settings, self._spans = settings, spans
        self._thread = SupervisedThread("dispatcher", self._run, most_failures=MOST_FAILURES)
        # From other threads: outcomes, and None to wake this thread.
        self._inbox: queue.SimpleQueue[tuple[Task, Outcome] | None] = queue.SimpleQueue()
        self._calls: deque[tuple[CallTask, Future[Outcome]]] = deque()
        self._cancelled: deque[str] = deque()
        self.metrics = Metrics()
        # The dispatcher's own.
        self._reports: list[tuple[JobTask, Outcome]] = []
        self._flying: set[JobTask] = set()
        self._answers: dict[CallTask, Future[Outcome]] = {}
        self._leaving: dict[str, float] = {}
        self._held = HeldTasks()
        self._pause_until = 0.0
        self._deadline: float | None = None
        self._starved = False
        self.throughput = Throughput(settings.workers)
        self._leadership, self._outages = Leadership(database), Outages(engine.alive)
        self._term: int | None = None
        self._next_stand = 0.0
        self._stale: set[JobTask] = set()
        self._in_doubt = False

    def start(self) -> None:
        """Begin; the first round takes back what an earlier service left unfinished."""
        if not self._database.shared:
            # Later, requests that write their files would lose them.
            remove_orphans(self._database, self._store)
        self._engine.start(self._report)
        self._thread.start()
        self.wake()

    def wake(self) -> None:
        """Wake the thread, because there may be work."""
        self._inbox.put(None)

    def cancel(self, render: str) -> None:
        """Stop the running tasks of a render whose row asks for it."""
        self._cancelled.append(render)
        self.wake()

    def call(self, task: CallTask) -> Future[Outcome]:
        """Run a trace or a quote before any waiting tile; cancel the future to stop it.

        Raises
        ------
        UnavailableError
            If too many others wait.
        """
        if len(self._calls) >= MAX_CALLS:
            raise UnavailableError("Too many others are waiting for an answer. Try again in a moment.")
        answer: Future[Outcome] = Future()
        answer.add_done_callback(lambda _: self.wake())
        self._calls.append((task, answer))
        self.wake()
        return answer

    def alive(self) -> bool:
        """Whether jobs are being worked on."""
        return self.lives() and self._engine.alive()

    def lives(self) -> bool:
        """Whether the thread that hands out work is alive; if not, the process must be restarted."""
        return self._thread.is_alive()

    def is_failing(self) -> bool:
        """Whether no work can be handed out, and has not been for a while."""
        return self._thread.is_failing()

    def stop(self) -> None:
        """Stop at once. What was running will be rendered again after the next start."""
        self._thread.stopping.set()
        self.wake()
        self._thread.stop()
        self._engine.close()
        self._resign()
        for answer in (*self._answers.values(), *(answer for _, answer in self._calls)):
            answer.cancel()

    def _run(self) -> None:
        try:
            while self._listen():
                self._round()
        except Exception:
            # How far the round came is unknown: what was handed out is taken back, as from another server.
            self._forget_tasks()
            self._term, self._next_stand, self._in_doubt = None, 0.0, True
            self.wake()
            raise

    def _report(self, task: Task, outcome: Outcome, /) -> None:
        self._inbox.put((task, outcome))

    def _listen(self) -> bool:
        """Wait until something happened and collect all of it; False at the end."""
        try:
            message = self._inbox.get(timeout=self._wait_seconds())
            while True:
                if message is not None:
                    self._record(*message)
                message = self._inbox.get_nowait()
        except queue.Empty:
            pass
        while self._cancelled:
            render = self._cancelled.popleft()
            if self._term is not None:
                self._leave(render, self._settings.cancel_grace_seconds)
        for task in self._held.release(self._leaving):
            self._flying.discard(task)
            self._reports.append((task, Released()))
        return not self._thread.stopping.is_set()

    def _wait_seconds(self) -> float | None:
        if self._leaving or self._stale:
            return LEAVING_SECONDS
        if self._pause_until:
            return max(0.0, self._pause_until - time.monotonic())
        waits = [EMPTY_SECONDS] if self._starved else []
        waits += [BEAT_SECONDS] if self._outages.beating else []
        if self._deadline:
            waits.append(self._deadline - time.monotonic())
        held = self._held.seconds_left()
        waits += [] if held is None else [held]
        return max(0.0, min(waits)) if waits else None

    def _record(self, task: Task, outcome: Outcome) -> None:
        if not isinstance(task, CallTask):
            if task in self._stale:
                self._stale.discard(task)
                return
            self._flying.discard(task)
            self.metrics.note(task, outcome)
            self._spans.came_back(task, outcome)
            self.throughput.note(getattr(outcome, "cpu_seconds", 0.0))
            self.throughput.watch(busy=bool(self._flying))
            self._reports.append((task, outcome))
            log_report(task, outcome)
            return
        answer = self._answers.pop(task)
        if isinstance(outcome, Interrupted):
            self._calls.appendleft((task, answer))
        elif answer.set_running_or_notify_cancel():
            if isinstance(outcome, TaskFailed) and outcome.passes:
                answer.set_exception(UnavailableError(outcome.message))
            else:
                answer.set_result(outcome)

    def _leave(self, render: str, grace: float) -> None:
        self._leaving.setdefault(render, time.monotonic() + grace)

    def _round(self) -> None:
        self._interrupt()
        self._answer_calls()
        if time.monotonic() < self._pause_until or not self._is_due():
            return
        self._pause_until = 0.0
        # Outside of the transaction: it may start processes.
        room = self._engine.room()
        self._starved = room == 0 and not self._flying
        try:
            with self._database.writing() as session:
                standing = self._leadership.stand(session)
                term = standing.number if standing else None
                if term != self._term:
                    self._forget_tasks()
                result = None if standing is None else self._decide(session, standing, room)
        except SQLAlchemyError as error:
            log.warning("database not usable, trying again", error=type(error).__name__)
            self._thread.note_failure()
            self._pause()
            # The transaction may have been committed, and the answer lost with the connection.
            self._in_doubt = True
            return
        if self._in_doubt:
            self._in_doubt = False
            self._job_events.publish_all()
        if term != self._term:
            self._lead(term)
            if term is not None and self._database.shared:
                SupervisedThread("tidy", partial(remove_orphans, self._database, self._store)).start()
        if result is not None:
            self.metrics.note_retries(result.retries)
            self._outages.note((outcome for _, outcome in self._reports), store_closed=result.store_closed)
            self._reports = []
            left = result.deadline_in
            self._deadline = None if left is None else time.monotonic() + left
            self._act(result)
        self._outages.beating = self._database.shared or bool(self._flying or self._deadline)
        self._thread.note_success()

    def _is_due(self) -> bool:
        """Whether to read the database: always, or now and then where another server leads."""
        if self._term is None:
            if time.monotonic() < self._next_stand:
                return False
            self._next_stand = time.monotonic() + BEAT_SECONDS
        return True

    def _decide(self, session: Session, term: Term, room: int) -> Round:
        """Write the results of all events; also look for renders that other servers cancelled."""
        taken_back = Counter[Cause]()
        follows = term.number != self._term
        if follows and self._thread.failures:
            # Perhaps there is a row that cannot be read: its job fails, and the others continue.
            damage.fail_unreadable(session)
        sharing.add_outage(session, self._outages.seconds(term, was_away=follows or self._in_doubt))
        if follows:
            taken_back[Cause.SERVER_LOST] = ledger.recover(session)
            self._database.notify(session, anything=True)
        elif self._in_doubt:
            known = {*self._flying, *(task for task, _ in self._reports)}
            taken_back[Cause.DATABASE_LOST] = ledger.take_back_unknown(session, known)
        result = Round(
            reports=self._reports,
            flying=self._flying,
            leaving=self._leaving,
            room=room,
            max_attempts=self._settings.max_attempts,
            worker_bytes=self._settings.worker_memory_bytes,
            retries=taken_back,
        )
        result.decide(session)
        self._database.notify_jobs(session, result.news)
        if self._database.shared:
            for render in set(ledger.unwanted(session)) - set(self._leaving):
                self.cancel(render)
        return result

    def _lead(self, term: int | None) -> None:
        """Start or stop handing out work, depending on which server leads."""
        if self._database.shared and term is not None:
            log.info("leads", term=term)
            self._job_events.publish_all()
        elif self._term is not None:
            log.warning("leads no more", term=self._term)
        self._term = term
        self.metrics.leads.set(term is not None)

    def _forget_tasks(self) -> None:
        """Stop what was handed out in an earlier term: the database expects no more of it."""
        self._stale |= self._flying - self._held.forget()
        self._flying, self._reports, self._leaving, self._deadline = set(), [], {}, None
        self.throughput.watch(busy=False)

    def _resign(self) -> None:
        if not self._database.shared:
            return
        try:
            with self._database.writing() as session:
                self._leadership.resign(session)
                self._database.notify(session, anything=True)
        except SQLAlchemyError as error:
            log.warning("another server leads when the time is up", error=type(error).__name__)

    def _interrupt(self) -> None:
        """Stop the tasks of renders that have ended, and calls whose requests have ended."""
        now = time.monotonic()
        late = {render for render, deadline in self._leaving.items() if deadline <= now}
        unwanted = {task for task, answer in self._answers.items() if answer.cancelled()} | self._stale
        if late or unwanted:
            self._engine.interrupt(
                lambda task: task in unwanted or (not isinstance(task, CallTask) and task.job in late)
            )

    def _answer_calls(self) -> None:
        for _ in range(min(self._engine.room(), len(self._calls))):
            task, answer = self._calls.popleft()
            if not answer.cancelled():
                self._answers[task] = answer
                self._engine.submit(task)

    def _act(self, result: Round) -> None:
        if result.store_closed:
            self._pause()
        for held, seconds in result.held:
            self._flying.add(held)
            self._held.hold(held, seconds)
        for task in result.tasks:
            self._spans.handed_out(task)
            self._engine.submit(task)
            # Not before: what the engine never got would be waited for.
            self._flying.add(task)
            self.throughput.watch(busy=True)
        for render in result.ended:
            self._spans.ended(render)
        self._job_events.publish(result.news)
        self._clear(result.ended)

    def _pause(self) -> None:
        self._pause_until = time.monotonic() + RETRY_SECONDS

    def _clear(self, ended: Mapping[str, JobState]) -> None:
        """Drop the tiles of renders that have ended, once nothing writes to them any more."""
        busy = {task.job for task in self._flying}
        for render, state in ended.items():
            if render in busy:
                self._leave(render, 0.0)
            else:
                self._leaving.pop(render, None)
                self._store.drop_tiles(render)
                log.info("render ended", render=render, state=state.value)
