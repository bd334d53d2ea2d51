"""Damaged rows of jobs: they are shown as damaged, and logged."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

import structlog
from pydantic import ValidationError
from sqlalchemy import Select, exists, select, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from schemas.api.jobs import Failure, Job, JobCost, JobLinks, JobState, Progress
from service.errors import DamagedJobError
from service.lifecycle import totals
from service.storage.database.models import JobRow, RenderRow

ROW_ERRORS = (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError)
"""Exceptions of rows with a value of another kind than their column's, or JSON of another form."""

MESSAGE = str(DamagedJobError())
UNKNOWN_TIME = datetime.fromtimestamp(0, UTC)
"""Stands for a time that cannot be read."""

log = structlog.get_logger()


@dataclass(frozen=True)
class UnreadableRow:
    """A row that cannot be loaded as a whole."""

    number: int
    error: Exception


def load(session: Session, query: Select[JobRow]) -> Sequence[JobRow | UnreadableRow]:
    """Load jobs; a damaged one is represented by an object for `describe`."""
    try:
        return session.scalars(query).all()
    except ROW_ERRORS:
        numbers = session.scalars(query.with_only_columns(JobRow.number)).all()
        return [_load_alone(session, number) for number in numbers]


def _load_alone(session: Session, number: int) -> JobRow | UnreadableRow:
    try:
        return session.scalars(select(JobRow).where(JobRow.number == number)).one()
    except ROW_ERRORS as error:
        return UnreadableRow(number, error)


@contextmanager
def reading(job_id: str) -> Iterator[None]:
    """Read one job; DamagedJobError if its rows cannot be read."""
    try:
        yield
    except ROW_ERRORS as error:
        note(job_id, error)
        raise DamagedJobError from error


class DamagedRenderError(DamagedJobError):
    """The row of a render cannot be used: its jobs fail, and others continue.

    Attributes
    ----------
    render : RenderRow
        It.
    """

    def __init__(self, render: RenderRow) -> None:
        super().__init__()
        self.render = render


@contextmanager
def using(render: RenderRow) -> Iterator[None]:
    """Work with the row of a render; DamagedRenderError if it cannot be used."""
    try:
        yield
    except ROW_ERRORS as error:
        raise DamagedRenderError(render) from error


def note(job_id: str, error: BaseException | None) -> None:
    """Log why the rows of a job cannot be read, once per job."""
    at = traceback.extract_tb(error.__traceback__)[-1] if error is not None else None
    _report(job_id, _reason(error), at and f"{at.name}, line {at.lineno}")


def fail_unreadable(session: Session) -> None:
    """Fail the open jobs that cannot be loaded, and each of their renders that no other job waits for."""
    for row in load(session, select(JobRow).where(JobRow.finished_at.is_(None))):
        if isinstance(row, UnreadableRow):
            _fail(session, row)


def _fail(session: Session, row: UnreadableRow) -> None:
    job = JobRow.number == row.number
    job_id, render = session.execute(select(JobRow.id, JobRow.render_number).where(job)).one()
    note(job_id, row.error)
    failure = Failure(code="job_damaged", message=MESSAGE, retryable=True)
    ended = {"state": JobState.FAILED, "failure": failure.model_dump(), "finished_at": datetime.now(UTC)}
    session.execute(update(JobRow).where(job).values(ended))
    totals.add_failed(session, failure.code, 1)
    waits = exists().where(JobRow.render_number == render, JobRow.finished_at.is_(None))
    unwanted = update(RenderRow).where(RenderRow.number == render, ~waits)
    session.execute(unwanted.values(state=JobState.FAILED))


def describe(session: Session, number: int, error: Exception, links_of: Callable[[str], JobLinks]) -> Job:
    """Describe a job by those of its columns that can be read, and log the reason, once."""
    job_id = session.scalars(select(JobRow.id).where(JobRow.number == number)).one()
    note(job_id, error)
    return Job(
        id=job_id,
        name=_read(session, number, JobRow.name),
        user=_read(session, number, JobRow.owner),
        state=_read(session, number, JobRow.state) or JobState.FAILED,
        width=0,
        height=0,
        quality={},
        progress=Progress(done=0, total=1, share=0.0),
        last_seq=0,
        created_at=_read(session, number, JobRow.created_at) or UNKNOWN_TIME,
        started_at=_read(session, number, JobRow.started_at),
        finished_at=_read(session, number, JobRow.finished_at),
        cost=JobCost(predicted_cpu_seconds=0.0, cpu_seconds=0.0, rays={}),
        links=links_of(job_id),
        damage=MESSAGE,
    )


def _read(session: Session, number: int, column: InstrumentedAttribute[Any]) -> Any:
    """Return one column; None if it cannot be read."""
    try:
        return session.scalars(select(column).where(JobRow.number == number)).one()
    except ROW_ERRORS:
        return None


def _reason(error: BaseException | None) -> str:
    """Say what cannot be read; values of users stay out of the log."""
    if isinstance(error, ValidationError):
        fields = (".".join(map(str, found["loc"])) for found in error.errors(include_input=False))
        return f"{error.title}: {', '.join(fields)}"
    return type(error).__name__


@lru_cache(maxsize=1024)
def _report(job_id: str, reason: str, where: str | None) -> None:
    log.error("job damaged", job=job_id, reason=reason, where=where)
