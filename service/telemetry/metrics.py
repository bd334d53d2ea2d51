"""Metrics for operators, in the text format of Prometheus.

Counters count what this process has seen since it started; gauges are read from the database on each scrape,
so that they are right after a restart too.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

from prometheus_client import CollectorRegistry, Counter, Gauge, ProcessCollector, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector
from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.lifecycle import totals
from service.lifecycle.rows import OPEN
from service.storage.database.conditions import WITH_ERROR
from service.storage.database.connection import Database
from service.storage.database.models import JobRow, RenderRow
from service.workers.tasks import Cause, Interrupted, JobTask, Outcome, TaskFailed, TileDone, WorkerDied

RECENT_RENDERS = 200
"""Newest pictures of target quality whose error is reported."""
UNKNOWN_USER = "unknown"
"""Label for jobs that were removed, or followed by many others, before metrics were read."""
MOST_UNPAID = 10_000
"""Renders whose user is not looked up yet; without a scraper their number would grow without bound."""


class Metrics:
    """Counts outcomes of tasks, and writes all metrics. Any thread may use it.

    Examples
    --------
    >>> Metrics().tiles.collect()[0].name
    'penumbra_tiles'
    """

    def __init__(self) -> None:
        here = self.registry = CollectorRegistry()
        ProcessCollector(registry=here)
        self.tiles = Counter("penumbra_tiles", "Tiles that were rendered, in all passes.", registry=here)
        self.leads = Gauge("penumbra_leads", "1 where this server hands out work.", registry=here)
        self.deaths = Counter("penumbra_worker_deaths", "Tasks that lost their worker.", registry=here)
        self.retries = Counter("penumbra_retries", "Tasks that are retried.", ["cause"], registry=here)
        # A counter that appears with its first retry shows no increase.
        self.note_retries(dict.fromkeys(Cause, 0))
        self.late = Counter("penumbra_late_tiles", "Tiles given up at a time limit.", registry=here)
        self.failures = Counter("penumbra_task_failures", "Tasks that failed.", ["code"], registry=here)
        self.cpu_seconds = Counter("penumbra_user_cpu_seconds", "Work of workers.", ["user"], registry=here)
        self._lock = threading.Lock()
        self._unpaid: defaultdict[str, float] = defaultdict(float)

    def note(self, task: JobTask, outcome: Outcome) -> None:
        """Count the outcome of a task."""
        match outcome:
            case TileDone():
                self.tiles.inc()
            case WorkerDied():
                self.deaths.inc()
            case TaskFailed(code=code):
                self.failures.labels(code).inc()
            case Interrupted(late=True):
                self.late.inc()
            case _:
                pass
        with self._lock:
            self._unpaid[task.job] += getattr(outcome, "cpu_seconds", 0.0)
            while len(self._unpaid) > MOST_UNPAID:
                self.cpu_seconds.labels(UNKNOWN_USER).inc(self._unpaid.pop(next(iter(self._unpaid))))

    def note_calls(self, seconds: Mapping[str, float]) -> None:
        """Count the cost of calls, by user."""
        for user, spent in seconds.items():
            self.cpu_seconds.labels(user).inc(spent)

    def note_retries(self, causes: Mapping[Cause, int]) -> None:
        """Count retried tasks, by cause."""
        for cause, count in causes.items():
            self.retries.labels(cause).inc(count)

    def text(self, database: Database) -> bytes:
        """Write all metrics.

        Raises
        ------
        sqlalchemy.exc.SQLAlchemyError
            The database cannot be read.
        """
        with database.reading() as session:
            self._charge(session)
            state = _State(list(_families(session)))
        return generate_latest(self.registry) + generate_latest(state.registry())

    def _charge(self, session: Session) -> None:
        """Charge the cost of renders to the users whose jobs started them."""
        with self._lock:
            unpaid, self._unpaid = self._unpaid, defaultdict(float)
        begun = select(JobRow.id, JobRow.owner).where(JobRow.id.in_(unpaid))
        owners = dict(session.execute(begun).all())
        for render, seconds in unpaid.items():
            self.cpu_seconds.labels(owners.get(render, UNKNOWN_USER)).inc(seconds)


class _State(Collector):
    """A collector of gauges that were read already."""

    def __init__(self, families: Iterable[GaugeMetricFamily]) -> None:
        self.families = families

    def collect(self) -> Iterable[GaugeMetricFamily]:
        """Return them."""
        return self.families

    def registry(self) -> CollectorRegistry:
        """A registry without other collectors."""
        made = CollectorRegistry()
        made.register(self)
        return made


def _families(session: Session) -> Iterator[GaugeMetricFamily]:
    depths = dict.fromkeys((JobState.QUEUED.value, JobState.RUNNING.value), 0)
    # SQLite would count all jobs by state where the condition is another column's.
    counted = select(JobRow.state, func.count()).where(JobRow.state.in_(OPEN)).group_by(JobRow.state)
    depths |= {state.value: count for state, count in session.execute(counted)}
    yield _by("penumbra_jobs", "Jobs that wait or run.", "state", depths)

    yield _by("penumbra_failed_jobs", "Failed jobs that are kept, by code.", "code", totals.failed(session))

    ratios = sorted(_ratios(session))
    shares = {str(share): ratios[round(share * (len(ratios) - 1))] for share in (0.5, 0.95) if ratios}
    description = (
        f"Error reached over the target error, of the last {RECENT_RENDERS} pictures with a target error."
    )
    yield _by("penumbra_error_over_target", description, "quantile", shares)


def _ratios(session: Session) -> Iterator[float]:
    """The error of each of the newest pictures over its target error."""
    asked = select(RenderRow.target_error, RenderRow.merges).where(text(WITH_ERROR))
    for target, merges in session.execute(asked.order_by(RenderRow.number.desc()).limit(RECENT_RENDERS)):
        error = merges[-1]["error"] if merges else None
        if target and error:
            yield error["estimate"] / target


def _by(name: str, description: str, label: str, values: Mapping[str, float]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, description, labels=[label])
    for value, number in values.items():
        family.add_metric([value], number)
    return family
