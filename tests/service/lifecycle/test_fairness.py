"""Fair scheduling, and queue positions that say in which order jobs start."""

import random
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import event, select

from schemas.api.jobs import Job, JobState
from service.jobs import usage
from service.lifecycle import fairness
from service.lifecycle.documents import documents
from service.lifecycle.rows import OPEN
from service.storage.database.connection import Database
from service.storage.database.models import JobRow
from service.workers.tasks import Interrupted, TileTask
from tests.service.rounds import Table
from tests.service.support import BOTH


class Workers(Table):
    """Workers that always take one tile more; each job has five."""

    def put(self, owner: str, count: int = 1, *, price: float = 5.0, priority: int = 0) -> list[str]:
        first = len(self.described())
        names = [f"{owner}-{first + number}" for number in range(count)]
        for name in names:
            self.add(name, samples=1, price=price, owner=owner, priority=priority)
        return names

    def serve(self) -> str:
        """Start one tile, and return its user."""
        return self.next().job.partition("-")[0]

    def turns(self, count: int) -> list[str]:
        """Render tiles one after another, each in a second, and return their users."""
        owners = []
        for _ in range(count):
            owners.append(self.serve())
            self.finish()
        return owners

    def described(self) -> dict[str, Job]:
        with self.database.reading() as session:
            rows = session.scalars(select(JobRow).order_by(JobRow.number.desc())).all()
            return {job.id: job for job in documents(session, rows)}

    def positions(self) -> dict[str, int]:
        found = {name: job.queue_position for name, job in self.described().items()}
        return {name: place for name, place in found.items() if place is not None}


@pytest.fixture
def workers(database: Database) -> Workers:
    return Workers(database)


def test_many_jobs_of_one_user_do_not_delay_another(workers: Workers) -> None:
    workers.put("ann", 60)
    workers.turns(20)
    workers.put("bob")
    # The newcomer is next, and then gets every other tile, until all five are done.
    assert workers.turns(12) == ["bob", "ann"] * 5 + ["ann", "ann"]


def test_users_share_cpu_seconds_and_not_tiles(workers: Workers) -> None:
    workers.put("ann", 10)
    workers.put("bob", 20)
    spent: Counter[str] = Counter()
    for _ in range(60):
        owner = workers.serve()
        cpu_seconds = 4.0 if owner == "ann" else 1.0
        spent[owner] += cpu_seconds
        workers.finish(cpu_seconds)
    # No user is ahead by more than one tile of the more expensive kind, before and after.
    assert abs(spent["ann"] - spent["bob"]) <= 2 * 4.0


@pytest.mark.slow
@pytest.mark.parametrize("earlier", [0, 1], ids=["newcomer", "after a pause"])
def test_idle_workers_leave_neither_credit_nor_debt(workers: Workers, earlier: int) -> None:
    workers.put("bob", earlier)
    workers.put("ann", 30)
    workers.turns(50)
    workers.put("bob", 10)
    assert abs(workers.turns(20).count("bob") - 10) <= 1


@BOTH
def test_tile_is_charged_with_its_cost(workers: Workers) -> None:
    workers.put("ann", price=50.0)
    workers.next()
    workers.round((workers.flying[0], Interrupted()))
    assert workers.served() == {"ann": pytest.approx(0.0)}
    workers.next()
    workers.finish(0.25)
    assert workers.served() == {"ann": pytest.approx(0.25)}


@BOTH
def test_calls_delay_the_tiles_of_their_user(workers: Workers) -> None:
    workers.put("ann", 2)
    workers.put("bob", 2)
    with workers.database.writing() as session:
        fairness.charge_calls(session, {"ann": 4.0})
    assert workers.turns(8).count("bob") == 6
    # A pause is no credit.
    with workers.database.writing() as session:
        fairness.charge_calls(session, {"eve": 4.0})
        assert {user.user: user.cpu_seconds for user in usage.page(session, 9, None)}["eve"] == 4.0
    workers.put("eve", 2)
    workers.put("fay", 2)
    assert "eve" not in workers.turns(4)


@BOTH
def test_priority_orders_ones_own_jobs_only(workers: Workers) -> None:
    plain = workers.put("ann")
    urgent = workers.put("ann", priority=5)
    others = workers.put("bob", priority=-5)
    assert [workers.next().job for _ in range(3)] == [*urgent, *others, *plain]


@BOTH
def test_shared_render_starts_with_the_first_of_its_jobs(workers: Workers) -> None:
    workers.put("ann", 5)
    (last,) = workers.put("ann")
    workers.join(last, "joined", "bob")
    assert workers.positions()[last] == workers.positions()["joined"] <= 1
    assert last in [workers.next().job for _ in range(2)]


@BOTH
def test_render_without_its_first_job_continues(workers: Workers) -> None:
    (name,) = workers.put("ann")
    workers.join(name, "joined", "bob")
    with workers.database.writing() as session:
        session.delete(session.scalars(select(JobRow).where(JobRow.id == name)).one())
    assert workers.next().job == name
    assert workers.served()["bob"] > 0


@BOTH
def test_slot_is_never_left_to_a_user_without_work(workers: Workers) -> None:
    workers.put("ann")
    workers.put("bob")
    started = 0
    while tasks := workers.round(room=4).tasks:
        started += sum(isinstance(task, TileTask) for task in tasks)
    assert started == 2 * 5


@BOTH
@pytest.mark.parametrize("seed", range(3))
def test_positions_are_the_order_in_which_jobs_start(workers: Workers, seed: int) -> None:
    rng = random.Random(seed)
    workers.put("ann", 3, price=7.0)
    for _ in range(6):
        workers.next()
        workers.finish(rng.uniform(0.5, 3.0))
    for owner in rng.choices(["ann", "bob", "eve"], k=12):
        workers.put(owner, price=rng.uniform(1.0, 50.0), priority=rng.randint(-2, 2))
    before = workers.positions()
    assert sorted(before.values()) == list(range(len(before)))
    begun: list[str] = []
    while any(job.state is JobState.QUEUED for job in workers.described().values()):
        task = workers.next()
        if task.pass_.index == 0:
            begun.append(task.job)
    assert [before[name] for name in begun if name in before] == list(range(len(before)))


@BOTH
def test_list_of_jobs_takes_three_queries(workers: Workers) -> None:
    workers.put("ann", 8)
    for _ in range(4):
        workers.next()
    with workers.database.reading() as session:
        rows = session.scalars(select(JobRow)).all()
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
