"""Lists of jobs: in pages, by state and label, searched, sorted and counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from sqlalchemy import ColumnElement, CompoundSelect, Select, exists, func, or_, select, union_all
from sqlalchemy.orm import aliased, defer, joinedload

from schemas.api.jobs import JobList, JobState
from service.jobs.context import Service
from service.lifecycle import damage
from service.lifecycle.documents import documents
from service.storage.database.models import JobRow, LabelRow, RenderRow

NEWEST_JOBS = 10_000
"""Only the newest jobs are searched, sorted and counted, so that a request reads a bounded number of rows."""

Labels = Mapping[str, Sequence[str]]
"""Names of labels with their wanted values: a job has one of those of each label."""
Sort = Literal["-created", "created", "name", "-name", "user", "-user"]
"""Keys that a list is sorted by; ``-`` reverses the order."""
NEWEST_FIRST: Sort = get_args(Sort)[0]

_KEYS: Mapping[str, ColumnElement[Any]] = {
    "created": JobRow.number.expression,
    "name": func.lower(func.coalesce(JobRow.name, "")),
    "user": JobRow.owner.expression,
}
# A list shows no passes, and needs no columns for encoding the picture or checking its files.
_LISTED = select(JobRow).options(
    joinedload(JobRow.render).options(
        defer(RenderRow.passes), defer(RenderRow.display), defer(RenderRow.checksums)
    )
)
_LABELLED = select(LabelRow.job).join(JobRow, JobRow.number == LabelRow.job)
_Other = aliased(LabelRow)


@dataclass(frozen=True)
class Listing:
    """The jobs that a list has, and their order.

    Attributes
    ----------
    owner, state, labels
        Only jobs of this user, in this state, with one of the values of each label; None takes all.
    search : str
        Part of the name or of a label, as ``name:value``.
    """

    owner: str | None = None
    state: JobState | None = None
    labels: Labels = field(default_factory=dict)
    search: str = ""
    sort: Sort = NEWEST_FIRST


def page(
    service: Service, wanted: Listing, limit: int, cursor: int | None, *, total: bool = False
) -> JobList:
    """Describe the first jobs of a list, or those that follow the page before."""
    counted = select(func.count()).select_from(JobRow).where(*_conditions(wanted))
    with service.database.reading() as session:
        found = damage.load(session, _paged(wanted, cursor, limit + 1))
        jobs = documents(session, found[:limit], service.settings.keep_seconds)
        number = session.scalar(counted) if total else None
    if len(found) <= limit:
        return JobList(jobs=jobs, next=None, total=number)
    following = found[limit - 1].number if wanted.sort == NEWEST_FIRST else (cursor or 0) + limit
    return JobList(jobs=jobs, next=str(following), total=number)


def _paged(wanted: Listing, cursor: int | None, limit: int) -> Select[JobRow]:
    """Select jobs: newest first so that an index has them in order, and a page reads what it shows."""
    newest = JobRow.number.desc()
    if wanted.sort != NEWEST_FIRST:
        key = _KEYS[wanted.sort.removeprefix("-")]
        order = key.desc() if wanted.sort.startswith("-") else key, newest
        numbers = select(JobRow.number).where(*_conditions(wanted)).order_by(*order)
        return _LISTED.where(JobRow.number.in_(numbers.limit(limit).offset(cursor or 0))).order_by(*order)
    query = _LISTED.order_by(newest).limit(limit)
    if wanted.search:
        return _after(query.where(*_conditions(wanted)), JobRow.number, None, cursor)
    if wanted.labels:
        return query.where(JobRow.number.in_(_labelled(wanted, cursor, limit)))
    if wanted.owner is not None:
        query = query.where(JobRow.owner == wanted.owner)
    return _after(query, JobRow.number, wanted.state, cursor)


def _conditions(wanted: Listing) -> list[ColumnElement[bool]]:
    """Conditions on the newest jobs that a list may have."""
    owned = [] if wanted.owner is None else [JobRow.owner == wanted.owner]
    newest = select(JobRow.number).where(*owned).order_by(JobRow.number.desc())
    oldest = newest.limit(1).offset(NEWEST_JOBS - 1).scalar_subquery()
    conditions = [*owned, JobRow.number >= func.coalesce(oldest, 0)]
    if wanted.state is not None:
        conditions.append(JobRow.state == wanted.state)
    for name, values in wanted.labels.items():
        conditions.append(_has_label(LabelRow.name == name, LabelRow.value.in_(values)))
    if wanted.search:
        label = LabelRow.name + ":" + LabelRow.value
        named, labelled = (text.icontains(wanted.search, autoescape=True) for text in (JobRow.name, label))
        conditions.append(or_(named, _has_label(labelled)))
    return conditions


def _has_label(*conditions: ColumnElement[bool]) -> ColumnElement[bool]:
    return exists().where(LabelRow.job == JobRow.number, *conditions)


def _labelled(wanted: Listing, cursor: int | None, limit: int) -> CompoundSelect[int]:
    """Select the newest jobs that have, of each label, one of the wanted values."""
    (name, values), *others = wanted.labels.items()
    query = _LABELLED.where(LabelRow.name == name).order_by(LabelRow.job.desc()).limit(limit)
    if wanted.owner is not None:
        query = query.where(LabelRow.owner == wanted.owner)
    for other, of_other in others:
        same = _Other.job == LabelRow.job, _Other.name == other
        query = query.where(exists().where(*same, _Other.value.in_(of_other)))
    query = _after(query, LabelRow.job, wanted.state, cursor)
    parts = (query.where(LabelRow.value == value).subquery() for value in dict.fromkeys(values))
    return union_all(*(select(part.c.job) for part in parts))


def _after(query: Select[Any], number: Any, state: JobState | None, cursor: int | None) -> Select[Any]:
    if state is not None:
        query = query.where(JobRow.state == state)
    return query if cursor is None else query.where(number < cursor)
