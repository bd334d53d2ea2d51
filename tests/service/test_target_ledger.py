"""The dispatcher's decisions about jobs with a target error. Real database, no engine."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import select

import renderer
from renderer.adaptive import Estimate
from renderer.adaptive.forecast import forecast, usual_prices
from schemas.api.jobs import JobState
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from service.dispatch import adaptive_passes as targets
from service.dispatch import ledger
from service.dispatch.rounds import Round
from service.lifecycle import progress, rows
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow, TileRow
from service.workers.tasks import (
    AdvanceDone,
    AdvanceTask,
    Interrupted,
    JobTask,
    Outcome,
    SampleTask,
    TileDone,
    WorkerDied,
    pass_of,
)
from tests.service.support import BOTH, enter, scene

DONE = TileDone(crc32=1, counts={"camera": 10}, cpu_seconds=0.5)
ERROR = {"estimate": 0.02, "low": 0.01, "high": 0.03}
MAX_ATTEMPTS = 3
TARGET = TargetQuality(mode="target", error=0.02)


TILES = {
    number: Tile(number, 32 * column, 32 * row, 32 * column + 32, 32 * row + 32)
    for number, (row, column) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1)), 1)
}
"""The quarters of the picture."""


def advanced(
    *tiles: int, samples: int = 10, later: float = 1.0, merging: float = 0.25, final: bool = False
) -> AdvanceDone:
    """A merged pass; the next one is predicted to take a CPU second."""
    return AdvanceDone(
        tiles=tuple(TILES[number] for number in tiles),
        samples=samples,
        next_seconds=1.0,
        later_seconds=later,
        prices={"pilots": 1e-5},
        ray_seconds=1e-5,
        error=ERROR,
        numerics={"non_finite": 0},
        cpu_seconds=merging,
        sha256="ab" if final else None,
    )


class Table:
    """Jobs of 64 x 64 pixels in a database: four tiles in the first pass, and more in later ones."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.flying: list[JobTask] = []
        self.retries = Counter[str]()

    def add(self, time_limit: float | None = None, name: str = "a") -> None:
        render = RenderRow(
            id=name,
            width=64,
            height=64,
            spec_sha256="",
            passes=[asdict(pass_of(0))],
            display={},
            total_steps=4,
            total_work=100,
            target_error=0.01,
            time_limit=time_limit,
            tile_size=32,
            predicted_cpu_seconds=1.0,
        )
        with self.database.writing() as session:
            enter(session, name, render)
            session.add_all(
                TileRow(**rows.new_step(render.number, pass_of(0), tile)) for tile in TILES.values()
            )

    def round(self, *reports: tuple[JobTask, Outcome], room: int = 8) -> list[JobTask]:
        self.flying = [task for task in self.flying if task not in {done for done, _ in reports}]
        result = Round(reports, self.flying, [], room, MAX_ATTEMPTS)
        with self.database.writing() as session:
            result.decide(session)
        self.flying += result.tasks
        self.retries += result.retries
        return result.tasks

    def merging(self) -> AdvanceTask:
        """Finish the tiles of a pass."""
        (task,) = self.round(*((task, DONE) for task in self.round()))
        assert isinstance(task, AdvanceTask)
        return task

    @property
    def job(self) -> RenderRow:
        with self.database.reading() as session:
            return session.scalars(select(RenderRow)).one()

    def spend(self, seconds: float) -> None:
        """Have the job begun so long ago."""
        with self.database.writing() as session:
            job = session.scalars(select(RenderRow)).one()
            job.started_at = datetime.now(UTC) - timedelta(seconds=seconds)


@pytest.fixture
def table(database: Database) -> Table:
    return Table(database)


@BOTH
def test_a_pass_is_merged_when_all_its_tiles_are_finished(table: Table) -> None:
    table.add()
    first, *others = table.round()
    assert [task.tile.index for task in (first, *others)] == [1, 2, 3, 4]  # type: ignore[union-attr]
    assert table.round(*((task, DONE) for task in others)) == []
    (task,) = table.round((first, DONE))
    assert isinstance(task, AdvanceTask)
    assert [part.tile.index for part in task.parts] == [1, 2, 3, 4]
    assert (task.merged, task.last) == (0, False)


def test_the_next_pass_has_the_tiles_that_were_decided_on(table: Table) -> None:
    table.add()
    tasks = table.round((table.merging(), advanced(2, 3)))
    assert all(isinstance(task, SampleTask) for task in tasks)
    assert [(task.pass_.index, task.tile.index, task.merged) for task in tasks] == [(1, 2, 1), (1, 3, 1)]  # type: ignore[union-attr]
    job = table.job
    assert (job.done_steps, job.total_steps, job.last_seq) == (5, 7, 5)
    assert job.merges[0]["error"] == ERROR
    assert (job.merges[0]["tiles"], job.merges[0]["rays"]) == (4, {"camera": 40})
    assert job.merges[0]["cpu_seconds"] == 4 * 0.5 + 0.25


def test_each_pass_is_reported_with_what_it_took_by_itself(table: Table) -> None:
    table.add()
    table.round((table.merging(), advanced(2, 3)), room=0)
    table.round((table.merging(), advanced(1)), room=0)
    assert [past["rays"] for past in table.job.merges] == [{"camera": 40}, {"camera": 20}]
    assert [past["cpu_seconds"] for past in table.job.merges] == [2.25, 1.25]


def test_a_pass_is_reported_with_what_it_and_all_before_it_took(table: Table) -> None:
    table.add()
    table.round((table.merging(), advanced(2, 3)), room=0)
    table.round((table.merging(), advanced(1)), room=0)
    first, second = progress.finished_passes(table.job)
    assert [(cost["cpu_seconds"], cost["rays"]) for cost in (first, second)] == [
        (2.25, {"camera": 40}),
        (3.5, {"camera": 60}),
    ]
    assert [first["seconds"], second["seconds"] - first["seconds"]] == pytest.approx(
        [past["seconds"] for past in table.job.merges]
    )
    assert first["error"] == second["error"] == ERROR


@BOTH
def test_the_last_pass_ends_the_job(table: Table) -> None:
    table.add()
    assert table.round((table.merging(), advanced(final=True))) == []
    job = table.job
    assert (job.state, job.image_sha256) == (JobState.SUCCEEDED, "ab")
    assert rows.share(job) == 1.0
    assert job.done_steps == job.total_steps == job.last_seq


def test_a_share_stays_where_it_is_when_a_pass_is_added(table: Table) -> None:
    table.add()
    task = table.merging()
    before = rows.share(table.job)
    # Forty of a hundred samples are taken; a thousand more are requested.
    assert before == 0.4
    # Of 2.25 CPU seconds that are spent, 1 for the pass, and 100 for what follows, less than 0.4 is done.
    table.round((task, advanced(1, 2, samples=1000, later=100.0)), room=0)
    assert rows.share(table.job) == before
    table.merging()
    assert rows.share(table.job) == pytest.approx(before, abs=1e-6)


def test_a_share_is_that_of_cpu_seconds_spent_and_predicted(table: Table) -> None:
    table.add()
    # 2.25 CPU seconds are spent on the first pass, 1 on the next, 1.75 on all others.
    table.round((table.merging(), advanced(1, 2, samples=20, later=1.75)), room=0)
    assert rows.share(table.job) == pytest.approx(2.25 / 5, rel=1e-12)
    first, second = table.round()
    table.round((first, DONE), room=0)
    assert rows.share(table.job) == pytest.approx(2.75 / 5, rel=1e-3)
    table.round((second, DONE), room=0)
    assert rows.share(table.job) == pytest.approx(3.25 / 5, rel=1e-3)


def test_merging_is_tried_again_after_a_death_and_a_stale_attempt_does_not_count(table: Table) -> None:
    table.add()
    first = table.merging()
    (second,) = table.round((first, WorkerDied()))
    assert isinstance(second, AdvanceTask)
    assert (second.pass_, second.parts, second.attempt) == (first.pass_, first.parts, 2)
    table.round((first, advanced(1, 2, 3)), room=0)
    assert table.job.merges == []
    table.round((second, advanced(2)), room=0)
    assert [past["attempt"] for past in table.job.merges] == [2]


def test_no_two_passes_are_merged_under_the_same_number(table: Table) -> None:
    table.add()
    table.round((table.merging(), advanced(2, 3)), room=0)
    lost = table.merging()
    table.flying = []
    with table.database.writing() as session:
        ledger.recover(session)
    (again,) = table.round()
    assert isinstance(again, AdvanceTask)
    assert (again.pass_, again.attempt) == (lost.pass_, lost.attempt + 1)
    table.round((again, advanced(1)), room=0)
    # The answer of the database was lost, so the same is reported once more.
    table.round((again, advanced(1)), room=0)
    last = table.merging()
    table.round((last, advanced(final=True)), room=0)
    assert [past["attempt"] for past in table.job.merges] == [1, 3, 4]
    assert table.job.final_prefix == "4-"


def test_merging_may_cost_three_workers_and_no_more(table: Table) -> None:
    table.add()
    task = table.merging()
    for _ in range(1, MAX_ATTEMPTS):
        (task,) = table.round((task, WorkerDied()))
    assert table.round((task, WorkerDied())) == []
    assert table.job.state is JobState.FAILED


def test_what_one_pass_has_cost_does_not_count_in_the_next(table: Table) -> None:
    table.add()
    for tiles in ((1, 2), (3,)):
        task = table.merging()
        for _ in range(1, MAX_ATTEMPTS):
            (task,) = table.round((task, WorkerDied()))
        table.round((task, advanced(*tiles)), room=0)
    assert table.job.state is JobState.RUNNING


@BOTH
def test_after_a_restart_a_pass_is_merged_again_and_no_tile_rendered(table: Table) -> None:
    table.add()
    before = table.merging()
    table.flying = []
    with table.database.writing() as session:
        ledger.recover(session)
    (task,) = table.round()
    assert isinstance(task, AdvanceTask)
    assert task.parts == before.parts


@BOTH
def test_when_the_time_is_spent_no_tile_begins_and_the_finished_ones_are_merged(table: Table) -> None:
    table.add(time_limit=10)
    table.round((table.merging(), advanced(1, 2, 3, 4)), room=0)
    running, unstarted = table.round(room=2)
    table.spend(11)
    # One runs, one had not begun when its turn came.
    (task,) = table.round((running, DONE), (unstarted, Interrupted(late=True)))
    assert not table.retries
    assert isinstance(task, AdvanceTask)
    assert task.last
    assert [part.tile.index for part in task.parts] == [1]
    table.round((task, advanced(final=True)))
    job = table.job
    assert job.state is JobState.SUCCEEDED
    assert job.done_steps == job.total_steps == job.last_seq == 4 + 1 + 1 + 1


@BOTH
def test_a_tile_that_was_late_while_time_is_left_is_not_handed_out_again_at_once(table: Table) -> None:
    table.add(time_limit=1000)
    table.round((table.merging(), advanced(1, 2)), room=0)
    late, other = table.round(room=2)
    result = Round([(late, Interrupted(late=True))], [other], [], 8, MAX_ATTEMPTS)
    with table.database.writing() as session:
        result.decide(session)
    assert (result.tasks, result.early) == ([], [late])
    # Released, it is one more task that was interrupted.
    (again,) = table.round((late, Interrupted()))
    assert (again.tile, again.attempt) == (late.tile, late.attempt + 1)  # type: ignore[union-attr]


def test_the_coarse_picture_is_made_however_short_the_time_is(table: Table) -> None:
    table.add(time_limit=10)
    first = table.round(room=1)
    table.spend(11)
    others = table.round()
    assert len(others) == 3
    assert all(isinstance(task, SampleTask) and task.seconds_left is None for task in (*first, *others))
    (task,) = table.round(*((task, DONE) for task in (*first, *others)))
    assert isinstance(task, AdvanceTask)
    assert task.last


def test_a_round_says_when_the_next_time_will_be_spent(table: Table) -> None:
    table.add(time_limit=10)
    table.round(room=1)
    result = Round([], [], [], 0, MAX_ATTEMPTS)
    with table.database.writing() as session:
        result.decide(session)
    assert result.deadline_in is not None
    assert 0 < result.deadline_in <= 10


def test_of_several_times_that_will_be_spent_a_round_says_the_first(table: Table) -> None:
    for name, limit in (("a", 4000.0), ("b", 1000.0), ("c", 3000.0)):
        table.add(time_limit=limit, name=name)
    for _ in range(3):
        table.round()
    result = Round([], table.flying, [], 0, MAX_ATTEMPTS)
    with table.database.writing() as session:
        result.decide(session)
    assert result.deadline_in is not None
    assert 0 < result.deadline_in <= 1000


def test_tiles_end_before_the_limit_by_as_much_as_merging_takes(table: Table) -> None:
    """0.25 and 2 seconds for the first two passes; of 4 seconds a quarter is the most."""
    table.add(time_limit=100)
    table.round((table.merging(), advanced(1, 2)), room=0)
    table.round((table.merging(), advanced(1, 2, merging=2.0)), room=0)
    job = table.job
    left = targets.time_left(job), targets.tile_time_left(job)
    assert left[0] is not None
    assert left[1] is not None
    assert left[0] - left[1] == pytest.approx(2.0, abs=0.1)
    job.time_limit = 4.0
    left = targets.time_left(job), targets.tile_time_left(job)
    assert left[0] is not None
    assert left[1] is not None
    assert left[0] - left[1] == pytest.approx(1.0, abs=0.1)


def test_with_a_time_limit_the_share_is_that_of_the_time_if_that_is_more(table: Table) -> None:
    table.add(time_limit=10)
    table.round((table.merging(), advanced(1, 2, samples=20, later=1000.0)), room=0)
    table.spend(6)
    job = table.job
    assert progress.share(job) == pytest.approx(0.6, abs=0.05)
    left = progress.remaining_seconds(job)
    assert left is not None
    assert 3 < left <= 4
    table.spend(11)
    assert progress.share(table.job) < 1
    assert progress.remaining_seconds(table.job) == 0


def test_the_first_pass_grows_to_the_share_that_is_predicted_of_it() -> None:
    document = scene(80, 48)
    document["camera"]["lens_radius"] = 0.1
    plan = renderer.compile_scene(document, TARGET)
    steps, columns = targets.begin(plan, TARGET, 32, 2)
    assert len(steps) == 3 * 2
    # With a lens every other pixel of every other row begins with 8 samples.
    rays = 8 * 40 * 24
    expected = forecast(Estimate.begin(plan), usual_prices(plan))
    share = expected.next / (expected.next + expected.later)
    assert rays / columns["total_work"] == pytest.approx(share, rel=1e-3)
