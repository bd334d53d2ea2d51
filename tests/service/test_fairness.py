"""Fair scheduling. Real database, no engine: each test sets the CPU seconds of tiles."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict

import pytest
from sqlalchemy import select

from renderer import tiling
from service.dispatch.rounds import Round
from service.lifecycle import fairness, progress, rows
from service.storage.database.connection import Database
from service.storage.database.models import JobRow, RenderRow, ShareRow, TileRow
from service.workers.tasks import ComposeDone, Interrupted, JobTask, Outcome, TileDone, TileTask
from tests.service.support import BOTH, enter, job_with


class Picture:
    """64 x 64 pixels: a coarse picture, and one pass over four tiles."""

    width = height = 64


class Workers:
    """Jobs in a database, and workers that always take one tile more."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.flying: list[JobTask] = []
        self.owners: dict[str, str] = {}

    def add(self, owner: str, count: int = 1, *, price: float = 5.0, priority: int = 0) -> list[str]:
        passes = tiling.passes(64, 64, 1)
        steps = [(pass_, tile) for pass_ in passes for tile in tiling.tiles(Picture(), pass_, 32)]
        names = [f"{owner}{len(self.owners) + number}" for number in range(count)]
        with self.database.writing() as session:
            for name in names:
                render = RenderRow(
                    id=name,
                    width=64,
                    height=64,
                    spec_sha256=name,
                    passes=[asdict(pass_) for pass_ in passes],
                    display={},
                    total_steps=len(steps),
                    total_work=sum(rows.work(pass_, tile) for pass_, tile in steps),
                    predicted_cpu_seconds=price,
                    numerics={},
                    pass_costs=progress.begin_passes([pass_.index for pass_, _ in steps]),
                )
                enter(session, name, render, owner=owner, priority=priority)
                session.add_all(TileRow(**rows.new_step(render.number, *step)) for step in steps)
        self.owners |= dict.fromkeys(names, owner)
        return names

    def round(self, *reports: tuple[JobTask, Outcome], room: int = 0) -> list[JobTask]:
        self.flying = [task for task in self.flying if task not in {done for done, _ in reports}]
        result = Round(reports, self.flying, [], room, 3)
        with self.database.writing() as session:
            result.decide(session)
        self.flying += result.tasks
        return result.tasks

    def next(self) -> str:
        """Start one tile, and return its user."""
        (task,) = self.round(room=1)
        return self.owners[task.job]

    def finish(self, cpu_seconds: float = 1.0) -> None:
        """End the tile that has run longest; pictures are put together at once."""
        done = TileDone(crc32=0, counts={"camera": 1}, cpu_seconds=cpu_seconds)
        for task in self.round((self.flying[0], done)):
            self.round((task, ComposeDone("ab", {})))

    def turns(self, count: int) -> list[str]:
        """Render tiles one after another, each in a second, and return their users."""
        owners = []
        for _ in range(count):
            owners.append(self.next())
            self.finish()
        return owners

    def served(self) -> dict[str, float]:
        with self.database.reading() as session:
            return {share.owner: share.served for share in session.scalars(select(ShareRow))}


@pytest.fixture
def workers(database: Database) -> Workers:
    return Workers(database)


def test_many_jobs_of_one_user_do_not_delay_anothers_one(workers: Workers) -> None:
    workers.add("ann", 300)
    workers.turns(20)
    workers.add("bob")
    # The newcomer is next, and then gets every other tile, until all five are done.
    assert workers.turns(12) == ["bob", "ann"] * 5 + ["ann", "ann"]


def test_users_get_the_same_cpu_seconds_and_not_the_same_number_of_tiles(workers: Workers) -> None:
    workers.add("ann", 30)
    workers.add("bob", 120)
    spent: Counter[str] = Counter()
    for _ in range(100):
        owner = workers.next()
        cpu_seconds = 4.0 if owner == "ann" else 1.0
        spent[owner] += cpu_seconds
        workers.finish(cpu_seconds)
    # No user is ahead by more than one tile of the more expensive kind, before and after.
    assert abs(spent["ann"] - spent["bob"]) <= 2 * 4.0


def test_a_pause_is_no_credit(workers: Workers) -> None:
    workers.add("bob")
    workers.add("ann", 100)
    workers.turns(100)
    workers.add("bob", 100)
    assert abs(workers.turns(20).count("bob") - 10) <= 1


def test_who_has_used_idle_workers_owes_nothing_for_it(workers: Workers) -> None:
    workers.add("ann", 100)
    workers.turns(100)
    workers.add("bob", 100)
    assert abs(workers.turns(20).count("bob") - 10) <= 1


@BOTH
def test_a_tile_is_charged_with_what_it_has_cost(workers: Workers) -> None:
    workers.add("ann", price=50.0)
    workers.next()
    workers.finish(0.25)
    assert workers.served() == {"ann": pytest.approx(0.25)}


@BOTH
def test_a_tile_that_is_to_be_done_again_costs_nothing(workers: Workers) -> None:
    workers.add("ann")
    workers.next()
    workers.round((workers.flying[0], Interrupted()))
    assert workers.served() == {"ann": pytest.approx(0.0)}
    assert workers.next() == "ann"


@BOTH
def test_priority_orders_ones_own_jobs_only(workers: Workers) -> None:
    plain = workers.add("ann")
    urgent = workers.add("ann", priority=5)
    others = workers.add("bob", priority=-5)
    assert [workers.round(room=1)[0].job for _ in range(3)] == [*urgent, *others, *plain]


@BOTH
def test_a_shared_render_goes_with_the_best_of_its_jobs(workers: Workers) -> None:
    workers.add("ann", 5)
    (last,) = workers.add("ann")
    with workers.database.writing() as session:
        render = session.scalars(select(RenderRow).where(RenderRow.id == last)).one()
        session.add(job_with("joined", render, owner="bob"))
        session.flush()
        fairness.activate(session, ["bob"])
    started = [workers.round(room=1)[0].job for _ in range(2)]
    assert last in started


@BOTH
def test_a_render_that_lost_its_first_job_continues_for_the_other(workers: Workers) -> None:
    (name,) = workers.add("ann")
    with workers.database.writing() as session:
        job = session.scalars(select(JobRow).where(JobRow.id == name)).one()
        session.add(job_with("joined", job.render, owner="bob"))
        session.delete(job)
        session.flush()
        fairness.activate(session, ["bob"])
    assert [task.job for task in workers.round(room=1)] == [name]
    assert set(workers.served()) == {"ann", "bob"}
    assert workers.served()["bob"] > 0


@BOTH
def test_a_free_slot_is_never_left_to_a_user_who_has_nothing(workers: Workers) -> None:
    workers.add("ann")
    workers.add("bob")
    started = 0
    while tasks := workers.round(room=4):
        started += sum(isinstance(task, TileTask) for task in tasks)
    assert started == 2 * 5
