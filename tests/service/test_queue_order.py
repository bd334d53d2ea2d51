"""The reported queue position is the order in which jobs start. Real database, no engine."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import event, select

from schemas.api.jobs import Job, JobState
from service.lifecycle.documents import documents
from service.lifecycle.rows import OPEN
from service.storage.database.connection import Database
from service.storage.database.models import JobRow
from service.workers.tasks import TileTask
from tests.service.support import BOTH, job_with
from tests.service.test_fairness import Workers

pytestmark = BOTH


@pytest.fixture
def workers(database: Database) -> Workers:
    return Workers(database)


def described(workers: Workers) -> dict[str, Job]:
    with workers.database.reading() as session:
        rows = session.scalars(select(JobRow).order_by(JobRow.number.desc())).all()
        return {job.id: job for job in documents(session, rows)}


def places(workers: Workers) -> dict[str, int]:
    """Of the jobs that are queued."""
    found = {name: job.queue_position for name, job in described(workers).items()}
    return {name: place for name, place in found.items() if place is not None}


def starts(workers: Workers) -> list[str]:
    """Hand out tiles until every job has begun, and name the jobs in the order in which they did."""
    begun: list[str] = []
    while any(job.state is JobState.QUEUED for job in described(workers).values()):
        (task,) = workers.round(room=1)
        if isinstance(task, TileTask) and task.pass_.index == 0:
            begun.append(task.job)
    return begun


@pytest.mark.parametrize("seed", range(4))
def test_jobs_start_in_the_order_of_their_places(workers: Workers, seed: int) -> None:
    rng = random.Random(seed)
    workers.add("ann", 3, price=7.0)
    for _ in range(6):
        workers.next()
        workers.finish(rng.uniform(0.5, 3.0))
    for owner in rng.choices(["ann", "bob", "eve"], k=12):
        workers.add(owner, price=rng.uniform(1.0, 50.0), priority=rng.randint(-2, 2))
    before = places(workers)
    assert sorted(before.values()) == list(range(len(before)))
    assert [before[name] for name in starts(workers) if name in before] == list(range(len(before)))


def test_one_job_of_another_user_is_not_behind_a_hundred(workers: Workers) -> None:
    workers.add("ann", 100)
    (bobs,) = workers.add("bob")
    assert places(workers)[bobs] <= 1


def test_a_job_of_a_higher_priority_is_before_older_ones(workers: Workers) -> None:
    older = workers.add("ann", 3)
    (urgent,) = workers.add("ann", priority=5)
    assert places(workers) == {urgent: 0} | {name: number + 1 for number, name in enumerate(older)}


def test_jobs_that_share_a_render_start_together(workers: Workers) -> None:
    first, second = workers.add("ann", 2)
    with workers.database.writing() as session:
        render = session.scalars(select(JobRow).where(JobRow.id == first)).one().render
        assert render is not None
        session.add(job_with("shared", render, owner="ann"))
    found = places(workers)
    assert (found[first], found["shared"], found[second]) == (0, 0, 2)


def test_a_list_of_many_jobs_takes_as_many_queries_as_one_job(workers: Workers) -> None:
    workers.add("ann", 8)
    for _ in range(4):
        workers.next()
    with workers.database.reading() as session:
        rows = session.scalars(select(JobRow)).all()
        states = [row.state for row in rows]
        assert states.count(JobState.QUEUED) == states.count(JobState.RUNNING) == 4
        with counted(workers.database) as statements:
            jobs = documents(session, rows)
        waiting = [next(row for row in rows if row.state is state) for state in OPEN]
        with counted(workers.database) as of_two:
            documents(session, waiting)
    assert len(statements) == len(of_two) == 3
    assert sum(len(job.rendering) for job in jobs) == 4


@contextmanager
def counted(database: Database) -> Iterator[list[str]]:
    statements: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_: object) -> None:
        statements.append(statement)

    event.listen(database.engine, "before_cursor_execute", note)
    yield statements
    event.remove(database.engine, "before_cursor_execute", note)
