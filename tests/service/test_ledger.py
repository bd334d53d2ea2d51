"""What the dispatcher decides: order, stale results, deaths, a full disk. Real database, no engine."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

import pytest
from sqlalchemy import select

from renderer import tiling
from schemas.api.jobs import JobState
from service.dispatch import ledger
from service.dispatch.rounds import Round
from service.lifecycle import progress, rows
from service.storage.database.connection import Database
from service.storage.database.models import JobRow, RenderRow, ShareRow, TileRow
from service.workers.tasks import (
    ComposeDone,
    ComposeTask,
    Interrupted,
    JobTask,
    Outcome,
    TaskFailed,
    TileDone,
    TileTask,
    WorkerDied,
)
from tests.service.support import BOTH, enter, job_with

pytestmark = BOTH

DONE = TileDone(
    crc32=2**32 - 1, counts={"camera": 3, "mirror": 0}, cpu_seconds=0.5, work={"shading_points": 2}
)
MAX_ATTEMPTS = 3


class Picture:
    """64 x 64 pixels: a coarse picture, and two passes over four tiles."""

    width = height = 64


class Table:
    """Jobs in a database, and rounds over them."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.flying: list[JobTask] = []

    def add(self, job_id: str) -> None:
        passes = tiling.passes(64, 64, 4)
        steps = [(pass_, tile) for pass_ in passes for tile in tiling.tiles(Picture(), pass_, 32)]
        render = RenderRow(
            id=job_id,
            width=64,
            height=64,
            spec_sha256="",
            passes=[asdict(pass_) for pass_ in passes],
            display={},
            total_steps=len(steps),
            total_work=1,
            predicted_cpu_seconds=1.0,
            numerics={"retried": 1},
            pass_costs=progress.begin_passes([pass_.index for pass_, _ in steps]),
        )
        with self.database.writing() as session:
            enter(session, job_id, render)
            session.add_all(TileRow(**rows.new_step(render.number, pass_, tile)) for pass_, tile in steps)

    def round(self, *reports: tuple[JobTask, Outcome], room: int = 0, leaving: Sequence[str] = ()) -> Round:
        self.flying = [task for task in self.flying if task not in {done for done, _ in reports}]
        result = Round(reports, self.flying, leaving, room, MAX_ATTEMPTS)
        with self.database.writing() as session:
            result.decide(session)
        self.flying += result.tasks
        return result

    def next(self) -> TileTask:
        (task,) = self.round(room=1).tasks
        assert isinstance(task, TileTask)
        return task

    def job(self, job_id: str) -> JobRow:
        with self.database.reading() as session:
            return session.scalars(select(JobRow).where(JobRow.id == job_id)).one()

    def render(self, job_id: str) -> RenderRow:
        render = self.job(job_id).render
        assert render is not None
        return render

    def cancel(self, job_id: str) -> None:
        with self.database.writing() as session:
            found = ledger.render_of(session, job_id)
            assert found is not None
            found.cancel_requested = True


@pytest.fixture
def table(database: Database) -> Table:
    return Table(database)


def places(tasks: Sequence[JobTask]) -> list[tuple[str, int, int]]:
    return [(task.job, task.pass_.index, task.tile.index) for task in tasks if isinstance(task, TileTask)]


def test_passes_come_one_after_the_other_and_the_coarse_one_first(table: Table) -> None:
    table.add("a")
    steps = [places([table.next()])[0][1:] for _ in range(9)]
    assert steps == [(0, 0), *((1, tile) for tile in range(4)), *((2, tile) for tile in range(4))]


def test_after_a_doubtful_transaction_steps_without_a_task_wait_again(table: Table) -> None:
    table.add("a")
    done, lost, flying = (table.next() for _ in range(3))
    table.round((done, DONE))
    with table.database.writing() as session:
        assert ledger.take_back_unknown(session, [flying]) == 1
    again = table.next()
    assert (again.tile, again.pass_, again.attempt) == (lost.tile, lost.pass_, lost.attempt + 1)
    assert table.next().attempt == 1


def test_users_whose_last_steps_were_lost_have_their_turn_again_and_pay_for_none(table: Table) -> None:
    table.add("a")
    assert [len(table.round(room=20).tasks) for _ in range(3)] == [1, 8, 0]
    with table.database.writing() as session:
        assert ledger.take_back_unknown(session, []) == 9
        assert [(share.active, share.served) for share in session.scalars(select(ShareRow))] == [(True, 0)]
    assert len(table.round(room=20).tasks) == 9


def test_a_new_job_shows_its_coarse_picture_before_older_jobs_continue(table: Table) -> None:
    table.add("a")
    table.round(room=2)
    table.add("b")
    table.add("c")
    assert places(table.round(room=4).tasks) == [("b", 0, 0), ("c", 0, 0), ("a", 1, 0), ("a", 1, 1)]


def test_slots_are_filled_from_the_next_job_when_one_has_nothing_left(table: Table) -> None:
    table.add("a")
    table.add("b")
    table.round(room=2)
    assert len(table.round(room=8).tasks) == 8
    assert places(table.round(room=2).tasks) == [("b", 1, 0), ("b", 1, 1)]


def test_a_result_counts_once(table: Table) -> None:
    table.add("a")
    task = table.next()
    table.round((task, DONE))
    table.round((task, DONE))
    job = table.render("a")
    assert (job.done_steps, job.last_seq, job.cpu_seconds) == (1, 1, 0.5)
    assert (job.rays, job.work) == ({"camera": 3, "mirror": 0}, {"shading_points": 2})


def test_a_result_of_an_older_attempt_does_not_count(table: Table) -> None:
    table.add("a")
    stale = table.next()
    assert table.round((stale, Interrupted())).retries == {"interrupted": 1}
    fresh = table.next()
    assert places([fresh]) == places([stale])
    table.round((stale, DONE))
    assert not table.round((stale, WorkerDied())).retries
    assert table.render("a").done_steps == 0
    table.round((fresh, DONE))
    assert table.render("a").done_steps == 1


@pytest.mark.parametrize("outcome", [DONE, WorkerDied(), TaskFailed("render_failed", "No.")])
def test_nothing_counts_after_a_job_was_to_be_cancelled(table: Table, outcome: Outcome) -> None:
    table.add("a")
    task = table.next()
    table.cancel("a")
    assert table.round(leaving=["a"], room=5).tasks == []
    assert table.job("a").state is JobState.RUNNING
    result = table.round((task, outcome), leaving=["a"], room=5)
    assert result.tasks == []
    assert result.ended.keys() == {"a"}
    assert not result.retries
    assert table.render("a").done_steps == 0
    assert table.job("a").state is JobState.CANCELLED


def test_a_tile_may_cost_three_workers_and_no_more(table: Table) -> None:
    table.add("a")
    retries = Counter[str]()
    for _ in range(MAX_ATTEMPTS):
        assert table.job("a").failure is None
        retries += table.round((table.next(), WorkerDied())).retries
    assert retries == {"worker_died": MAX_ATTEMPTS - 1}
    failure = table.job("a").failure
    assert failure is not None
    assert (failure["code"], failure["retryable"]) == ("worker_died", True)
    assert table.round(room=5).tasks == []


def test_a_worker_that_dies_on_the_last_step_of_a_user_gives_the_user_a_turn_again(table: Table) -> None:
    table.add("a")
    tasks = [task for _ in range(3) for task in table.round(room=20).tasks]
    assert len(tasks) == 9
    (again,) = table.round((tasks[-1], WorkerDied()), room=20).tasks
    assert places([again]) == places(tasks[-1:])


def test_interruptions_are_no_fault_of_a_task(table: Table) -> None:
    table.add("a")
    for _ in range(3 * MAX_ATTEMPTS):
        table.round((table.next(), Interrupted()))
    assert table.job("a").state is JobState.RUNNING


def test_an_error_of_the_renderer_fails_the_job_with_its_words(table: Table) -> None:
    table.add("a")
    result = table.round((table.next(), TaskFailed("render_failed", "Pixel 3 is lost.")))
    failure = {"code": "render_failed", "message": "Pixel 3 is lost.", "retryable": False}
    assert table.job("a").failure == failure
    assert result.ended == {"a": JobState.FAILED}


def test_what_fails_a_render_fails_all_its_jobs(table: Table) -> None:
    table.add("a")
    with table.database.writing() as session:
        session.add(job_with("b", session.scalars(select(RenderRow)).one(), owner="other"))
    result = table.round((table.next(), TaskFailed("render_failed", "Pixel 3 is lost.")))
    assert result.news == {"a", "b"}
    for job in (table.job("a"), table.job("b")):
        assert (job.state, job.failure and job.failure["message"]) == (JobState.FAILED, "Pixel 3 is lost.")


def test_all_jobs_of_a_render_have_its_news(table: Table) -> None:
    table.add("a")
    table.add("c")
    with table.database.writing() as session:
        render = session.scalars(select(RenderRow).where(RenderRow.id == "a")).one()
        session.add(job_with("b", render, owner="other"))
    result = table.round(room=1)
    assert [task.job for task in result.tasks] == ["a"]
    assert result.news == {"a", "b"}
    assert [table.job(name).state.value for name in "abc"] == ["running", "running", "queued"]


def test_a_full_disk_makes_jobs_wait_and_not_fail(table: Table) -> None:
    table.add("a")
    task = table.next()
    result = table.round((task, TaskFailed("storage_full", "Full.")), room=5)
    assert result.store_closed
    assert result.tasks == []
    assert table.job("a").state is JobState.RUNNING
    assert places([table.next()]) == places([task])


def test_a_read_only_disk_makes_jobs_wait_and_not_fail(table: Table) -> None:
    table.add("a")
    task = table.next()
    result = table.round((task, TaskFailed("storage_read_only", "Closed.")), room=5)
    assert result.store_closed
    assert result.retries == {"storage_read_only": 1}
    assert places([table.next()]) == places([task])


@pytest.mark.parametrize("code", ["out_of_memory", "took_too_long"])
def test_a_picture_that_cannot_be_put_together_says_why(table: Table, code: str) -> None:
    table.add("a")
    (compose,) = table.round(*((task, DONE) for task in [table.next() for _ in range(9)])).tasks
    table.round((compose, TaskFailed(code, "Too much.")))
    assert table.job("a").failure == {"code": code, "message": "Too much.", "retryable": False}


def test_a_picture_whose_tiles_are_damaged_may_be_rendered_again(table: Table) -> None:
    table.add("a")
    (compose,) = table.round(*((task, DONE) for task in [table.next() for _ in range(9)])).tasks
    table.round((compose, TaskFailed("render_failed", "StoreDamagedError")))
    failure = table.job("a").failure
    assert failure is not None
    assert (failure["code"], failure["retryable"]) == ("storage_failed", True)


def test_the_picture_is_put_together_once_all_tiles_are_there(table: Table) -> None:
    table.add("a")
    tasks = [table.next() for _ in range(9)]
    for task in tasks[:-1]:
        assert table.round((task, DONE)).tasks == []
    (compose,) = table.round((tasks[-1], DONE)).tasks
    assert isinstance(compose, ComposeTask)
    order = [(part.tile.index, part.pass_.index) for part in compose.parts]
    assert order == [(tile, pass_) for tile in range(4) for pass_ in (1, 2)]
    assert table.round(room=5).tasks == []
    table.round((compose, ComposeDone("ab", {"clamped": 2})))
    render = table.render("a")
    assert (table.job("a").state, render.state) == (JobState.SUCCEEDED, JobState.SUCCEEDED)
    assert render.image_sha256 == "ab"
    assert render.numerics == {"retried": 1, "clamped": 2}


def costs(table: Table) -> list[tuple[int, float, int, float | None]]:
    """What is reported of each finished pass: its index, CPU seconds, camera rays, and error."""
    return [
        (entry["pass_index"], entry["cpu_seconds"], entry["rays"]["camera"], entry["error"])
        for entry in progress.finished_passes(table.render("a"))
    ]


def test_a_pass_is_reported_when_its_last_tile_is_there_with_all_that_was_done_before(table: Table) -> None:
    table.add("a")
    tasks = [table.next() for _ in range(9)]
    assert costs(table) == []
    table.round((tasks[0], DONE))
    assert costs(table) == [(0, 0.5, 3, None)]
    # The last tile of pass 1 comes after one of pass 2.
    for place in (1, 2, 3, 5):
        table.round((tasks[place], DONE))
    assert costs(table) == [(0, 0.5, 3, None)]
    table.round((tasks[4], DONE))
    assert costs(table) == [(0, 0.5, 3, None), (1, 2.5, 15, None)]
    table.round(*((task, DONE) for task in tasks[6:]))
    assert costs(table) == [(0, 0.5, 3, None), (1, 2.5, 15, None), (2, 4.5, 27, None)]


def test_a_pass_does_not_end_before_an_earlier_one(table: Table) -> None:
    table.add("a")
    tasks = [table.next() for _ in range(9)]
    for task in (tasks[0], *tasks[5:]):
        table.round((task, DONE))
    assert [index for index, *_ in costs(table)] == [0]
    for task in tasks[1:5]:
        table.round((task, DONE))
    seconds = [entry["seconds"] for entry in progress.finished_passes(table.render("a"))]
    assert seconds == sorted(seconds)
    assert seconds[1] == seconds[2] > seconds[0]


def test_a_tile_that_is_tried_again_is_counted_once(table: Table) -> None:
    table.add("a")
    first = table.next()
    table.round((first, WorkerDied()))
    again = table.next()
    table.round((first, DONE))
    assert costs(table) == []
    table.round((again, DONE), (again, DONE))
    assert costs(table) == [(0, 0.5, 3, None)]


def test_errors_of_passes_come_with_the_picture(table: Table) -> None:
    table.add("a")
    (compose,) = table.round(*((task, DONE) for task in [table.next() for _ in range(9)])).tasks
    error = {"estimate": 0.02, "low": 0.01, "high": 0.03}
    table.round((compose, ComposeDone("ab", {}, {2: error})))
    assert [entry[3] for entry in costs(table)] == [None, None, error]


def test_putting_together_is_tried_again_after_a_death(table: Table) -> None:
    table.add("a")
    tasks = [table.next() for _ in range(9)]
    (compose,) = table.round(*((task, DONE) for task in tasks)).tasks
    # Attempts that failed because the disk was full do not count.
    for _ in range(MAX_ATTEMPTS):
        table.round((compose, TaskFailed("storage_full", "Full.")))
        (compose,) = table.round().tasks
    for _ in range(1, MAX_ATTEMPTS):
        result = table.round((compose, WorkerDied()))
        assert result.retries == {"worker_died": 1}
        (compose,) = result.tasks
    last = table.round((compose, WorkerDied()))
    assert (last.tasks, dict(last.retries)) == ([], {})
    failure = table.job("a").failure
    assert failure is not None
    assert (failure["code"], failure["retryable"]) == ("worker_died", True)


def test_after_a_restart_only_what_ran_is_handed_out_again(table: Table) -> None:
    table.add("a")
    first, second = table.next(), table.next()
    table.round((first, DONE))
    with table.database.writing() as session:
        assert ledger.recover(session) == 1
    again = table.next()
    assert places([again]) == places([second])
    assert again.attempt == second.attempt + 1


def test_a_restart_ends_what_was_being_cancelled(table: Table) -> None:
    table.add("a")
    table.next()
    table.cancel("a")
    with table.database.writing() as session:
        ledger.recover(session)
    assert table.job("a").state is JobState.CANCELLED
