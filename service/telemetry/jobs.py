"""Spans of jobs and of attempts at their tiles.

A job outlives the process that accepted it, and another one may render it. So its span has the job's own id,
which is as long as a span's, in the trace that is stored with its render: spans of tiles find their parent,
and the span itself is sent when the job has ended.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

from opentelemetry import trace
from opentelemetry.context import Context
from opentelemetry.sdk.trace.id_generator import RandomIdGenerator
from opentelemetry.trace import NonRecordingSpan, Span, SpanContext, Status, StatusCode, Tracer
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator
from sqlalchemy import Row, bindparam, select
from sqlalchemy.exc import SQLAlchemyError

from schemas.api.jobs import JobState
from service.storage.database.connection import Database
from service.storage.database.models import JobRow, RenderRow
from service.telemetry.spans import JobSpans
from service.workers.tasks import (
    AdvanceTask,
    JobTask,
    Outcome,
    TaskFailed,
    TileTask,
    WorkerDied,
    log_names,
)

# Renders whose traces are cached.
KEPT_TRACES = 1024
JOB = "penumbra.job"

Ended = tuple[str | None, JobState, datetime, datetime | None, dict[str, Any] | None]
_W3C = TraceContextTextMapPropagator()
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_TRACE = select(RenderRow.traceparent).where(RenderRow.id == bindparam("id"))
_ENDED = (
    select(RenderRow.traceparent, RenderRow.state, JobRow.created_at, JobRow.finished_at, JobRow.failure)
    .join(JobRow, JobRow.render_number == RenderRow.number)
    .where(RenderRow.id == bindparam("id"))
    .order_by(JobRow.number)
    .limit(1)
)


class Ids(RandomIdGenerator):
    """Ids of spans: any, or one that is given."""

    def __init__(self) -> None:
        self._given = threading.local()

    @contextmanager
    def giving(self, span_id: int) -> Iterator[None]:
        """Give an id to the spans that this thread begins."""
        self._given.span_id = span_id
        try:
            yield
        finally:
            del self._given.span_id

    def generate_span_id(self) -> int:
        """Make the id of a span."""
        given: int | None = getattr(self._given, "span_id", None)
        return given or int(super().generate_span_id())


class SentJobSpans(JobSpans):
    """Spans of jobs and of attempts at their tiles, if the submitting request has one.

    Parameters
    ----------
    tracer, ids
        Those of the same provider.
    database
        Used to look up jobs; if it cannot be read, only spans are missing.
    """

    def __init__(self, tracer: Tracer, ids: Ids, database: Database) -> None:
        self._tracer, self._ids, self._database = tracer, ids, database
        self._begun: WeakKeyDictionary[JobTask, Span] = WeakKeyDictionary()
        self._sent: deque[str] = deque(maxlen=KEPT_TRACES)
        self._traces = lru_cache(KEPT_TRACES)(self._look_up)

    def here(self) -> str | None:
        """The current span as a ``traceparent``; None if there is none."""
        carrier: dict[str, str] = {}
        _W3C.inject(carrier)
        return carrier.get("traceparent")

    def taken(self, job: str, render: str | None, *, shared: bool) -> None:
        """Record in the current span which job it submitted, and which render that shares."""
        span = trace.get_current_span()
        span.set_attribute(JOB, job)
        shown = self._of(render) if shared and render else None
        if shown is not None:
            span.add_link(shown)

    def handed_out(self, task: JobTask) -> None:
        """Begin an attempt."""
        above = self._of(task.job)
        if above is not None:
            parent = trace.set_span_in_context(NonRecordingSpan(above))
            attributes = {f"penumbra.{name}": value for name, value in log_names(task).items()}
            self._begun[task] = self._tracer.start_span(_kind(task), parent, attributes=attributes)

    def came_back(self, task: JobTask, outcome: Outcome) -> None:
        """End an attempt."""
        span = self._begun.pop(task, None)
        if span is None:
            return
        span.set_attribute("penumbra.outcome", type(outcome).__name__)
        span.set_attribute("penumbra.cpu_seconds", getattr(outcome, "cpu_seconds", 0.0))
        if isinstance(outcome, WorkerDied):
            span.set_status(Status(StatusCode.ERROR, "worker_died"))
        elif isinstance(outcome, TaskFailed):
            span.set_status(Status(StatusCode.ERROR, outcome.code))
        span.end()

    def ended(self, render: str) -> None:
        """Record what was rendered, once it has ended and the database knows it."""
        if render in self._sent:
            return
        self._sent.append(render)
        with suppress(SQLAlchemyError), self._database.reading() as session:
            row = session.execute(_ENDED, {"id": render}).first()
            if row is not None and row.traceparent is not None:
                self._send(render, row)

    def _send(self, render: str, row: Row[Ended]) -> None:
        begun = _nanoseconds(row.created_at)
        with self._ids.giving(int(render, 16)):
            span = self._tracer.start_span(
                "job", _context(row.traceparent), attributes={JOB: render}, start_time=begun
            )
        span.set_attribute("penumbra.state", row.state.value)
        if row.failure is not None:
            span.set_status(Status(StatusCode.ERROR, row.failure["code"]))
        span.end(_nanoseconds(row.finished_at))

    def _of(self, render: str) -> SpanContext | None:
        with suppress(SQLAlchemyError):
            return self._traces(render)
        return None

    def _look_up(self, render: str) -> SpanContext | None:
        """Find the span of a job; None if the request that brought it had none."""
        with self._database.reading() as session:
            traceparent = session.scalar(_TRACE, {"id": render})
        if traceparent is None:
            return None
        above = trace.get_current_span(_context(traceparent)).get_span_context()
        return SpanContext(above.trace_id, int(render, 16), is_remote=True, trace_flags=above.trace_flags)


def _context(traceparent: str) -> Context:
    return _W3C.extract({"traceparent": traceparent}, Context())


def _kind(task: JobTask) -> str:
    match task:
        case TileTask():
            return "tile"
        case AdvanceTask():
            return "merge"
        case _:
            return "compose"


def _nanoseconds(moment: datetime) -> int:
    """Nanoseconds since 1970."""
    return (moment - _EPOCH) // timedelta(microseconds=1) * 1000
