"""The dispatcher: the thread that hands out work and records its outcome.

It sleeps until something happens: a job arrives, a task ends, a job is cancelled. Then one round writes all
results and claims in one transaction, gives the claimed tasks to the engine, and notifies the watchers.
`Flights` knows the tasks of jobs that are handed out, `CallDesk` the calls, and `Leadership` whether this
server works on jobs: of several servers on one database one does, and all answer calls.
"""

from __future__ import annotations

import queue
import time
from collections import Counter, deque
from functools import partial

import structlog
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from service.dispatch import ledger
from service.dispatch.call_desk import CallDesk
from service.dispatch.flights import Flights
from service.dispatch.job_events import JobEvents
from service.dispatch.leadership import BEAT_SECONDS, Leadership, Term
from service.dispatch.orphans import remove_orphans
from service.dispatch.outages import Outages
from service.dispatch.rounds import Round, log_report
from service.dispatch.throughput import Throughput
from service.lifecycle import damage, fairness, sharing
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.tiles import TileStore
from service.supervision import SupervisedThread
from service.telemetry.metrics import Metrics
from service.telemetry.spans import JobSpans
from service.workers.engines import Engine
from service.workers.tasks import CallTask, Cause, JobTask, Outcome, Task

# Seconds before the next try after an error of the database or a full disk.
RETRY_SECONDS = 1.0
# Seconds between checks whether a running task of a render that has ended is gone.
LEAVING_SECONDS = 0.05
# Seconds between checks for free workers while an engine has none: they may come back, or be overdue.
EMPTY_SECONDS = 1.0
# Errors in a row, but for those of the database, before the process ends: the last after 8 seconds of waits.
MOST_FAILURES = 5

log = structlog.get_logger()


class Dispatcher:
    """Keeps the engine busy with the jobs in the database, and with calls.

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
        self._cancelled: deque[str] = deque()
        self.metrics, self.throughput = Metrics(), Throughput(settings.workers)
        self.desk = CallDesk(settings.max_user_calls, settings.workers, self.wake)
        # The dispatcher's own.
        self._flights, self._leadership, self._outages = (
            Flights(),
            Leadership(database),
            Outages(engine.alive),
        )
        self._pause_until = 0.0
        self._deadline: float | None = None
        self._starved = self._in_doubt = False

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
        """Stop at once. Running tasks are rendered again after the next start."""
        self._thread.stopping.set()
        self.wake()
        self._thread.stop()
        self._engine.close()
        self._leadership.resign()
        self.desk.close()

    def _run(self) -> None:
        try:
            while self._listen():
                self._work()
        except Exception:
            # The progress of the round is unknown, so all handed-out tasks are taken back, as from another
            # server.
            self._forget_tasks()
            self._leadership.forget()
            self._in_doubt = True
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
            if self._leadership.term is not None:
                self._flights.leave(render, self._settings.cancel_grace_seconds)
        self._flights.release()
        return not self._thread.stopping.is_set()

    def _wait_seconds(self) -> float | None:
        if self._flights.are_leaving():
            return LEAVING_SECONDS
        if self._pause_until:
            return max(0.0, self._pause_until - time.monotonic())
        waits = [EMPTY_SECONDS] if self._starved else []
        waits += [BEAT_SECONDS] if self._outages.beating else []
        waits += [self._deadline - time.monotonic()] if self._deadline else []
        held = self._flights.held_seconds()
        waits += [] if held is None else [held]
        return max(0.0, min(waits)) if waits else None

    def _record(self, task: Task, outcome: Outcome) -> None:
        if isinstance(task, CallTask):
            self.desk.record(task, outcome)
        elif self._flights.land(task, outcome):
            self.metrics.note(task, outcome)
            self._spans.came_back(task, outcome)
            self.throughput.note(getattr(outcome, "cpu_seconds", 0.0))
            self.throughput.watch(busy=bool(self._flights.tasks))
            log_report(task, outcome)

    def _work(self) -> None:
        """Kill abandoned tasks, and hand out calls and tiles in turns."""
        unwanted: set[Task] = self.desk.unwanted() | self._flights.unwanted()
        if unwanted:
            self._engine.interrupt(unwanted.__contains__)
        if self.desk.is_next:
            self._answer_calls()
        if time.monotonic() >= self._pause_until and self._leadership.is_due():
            self._round()
        self._answer_calls()

    def _answer_calls(self) -> None:
        for task in self.desk.hand_out(self._engine.room()):
            self._engine.submit(task)

    def _round(self) -> None:
        self._pause_until = 0.0
        # Outside of the transaction: it may start processes.
        engine = self._engine
        room, idle, spare = engine.room(), engine.idle(), engine.spare()
        self._starved = idle == 0
        charges = self.desk.charges
        try:
            with self._database.writing() as session:
                begun = time.monotonic()
                standing = self._leadership.stand(session)
                fairness.charge_calls(session, charges)
                term = standing.number if standing else None
                if term != self._leadership.term:
                    self._forget_tasks()
                result = None
                if standing is not None:
                    result = self._decide(session, standing, begun, room, idle, spare)
        except SQLAlchemyError as error:
            log.warning("database unavailable; retrying", error=type(error).__name__)
            self._thread.note_failure()
            self._pause()
            # The transaction may have been committed, and the answer lost with the connection.
            self._in_doubt = True
            return
        self.metrics.note_calls(charges)
        charges.clear()
        self._follow(term)
        if result is not None:
            self._act(result)
        self._outages.beating = self._database.shared or bool(self._flights.tasks or self._deadline)
        self._thread.note_success()

    def _decide(self, session: Session, term: Term, begun: float, room: int, idle: int, spare: int) -> Round:
        """Write the results of all events; also look for renders that other servers cancelled."""
        flights, taken_back = self._flights, Counter[Cause]()
        follows = term.number != self._leadership.term
        if follows and self._thread.failures:
            # Perhaps there is a row that cannot be read: its job fails, and the others continue.
            damage.fail_unreadable(session)
        sharing.add_outage(session, self._outages.seconds(term, was_away=follows or self._in_doubt))
        if follows:
            taken_back[Cause.SERVER_LOST] = ledger.recover(session)
            self._database.notify(session, anything=True)
        elif self._in_doubt:
            known = {*flights.tasks, *(task for task, _ in flights.reports)}
            taken_back[Cause.DATABASE_LOST] = ledger.take_back_unknown(session, known)
        result = Round(
            reports=flights.reports,
            flying=flights.tasks,
            leaving=flights.leaving,
            room=room,
            idle=idle,
            spare=spare,
            max_attempts=self._settings.max_attempts,
            worker_bytes=self._settings.worker_memory_bytes,
            begun=begun,
            retries=taken_back,
        )
        result.decide(session)
        self._database.notify_jobs(session, result.news)
        if self._database.shared:
            for render in set(ledger.unwanted(session)) - set(flights.leaving):
                self.cancel(render)
        return result

    def _follow(self, term: int | None) -> None:
        """Start or stop handing out work, depending on which server leads."""
        changed = self._leadership.enter(term)
        self.metrics.leads.set(term is not None)
        if self._in_doubt or (changed and term is not None and self._database.shared):
            self._job_events.publish_all()
        if changed and term is not None and self._database.shared:
            SupervisedThread("tidy", partial(remove_orphans, self._database, self._store)).start()
        self._in_doubt = False

    def _forget_tasks(self) -> None:
        """Stop tasks that were handed out in an earlier term: the database expects no results from them."""
        self._flights.forget()
        self._deadline = None
        self.throughput.watch(busy=False)

    def _act(self, result: Round) -> None:
        """Carry out the decisions of a round, which the database has committed."""
        flights, left = self._flights, result.deadline_in
        self.metrics.note_retries(result.retries)
        self._outages.note((outcome for _, outcome in flights.reports), store_closed=result.store_closed)
        flights.reports = []
        self._deadline = None if left is None else time.monotonic() + left
        if result.store_closed:
            self._pause()
        for held, seconds in result.held:
            flights.hold(held, seconds)
        for task in result.tasks:
            self._hand_out(task, spare=result.may_be_spare(task))
        for render in result.ended:
            self._spans.ended(render)
        self._job_events.publish(result.news)
        for render in flights.clear(result.ended):
            self._store.drop_tiles(render)
            log.info("render ended", render=render, state=result.ended[render].value)

    def _hand_out(self, task: JobTask, *, spare: bool) -> None:
        self._spans.handed_out(task)
        self._engine.submit(task, spare=spare)
        # Not before the commit: tasks that the engine never got would be awaited.
        self._flights.tasks.add(task)
        self.desk.is_next = True
        self.throughput.watch(busy=True)

    def _pause(self) -> None:
        self._pause_until = time.monotonic() + RETRY_SECONDS
