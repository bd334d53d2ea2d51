"""Decisions of the dispatcher: order, stale results, crashes, a full disk."""

from collections import Counter

import pytest

from schemas.api.jobs import JobState
from service.dispatch import ledger
from service.lifecycle import progress
from service.storage.database.connection import Database
from service.workers.tasks import (
    ComposeDone,
    ComposeTask,
    Interrupted,
    JobTask,
    Outcome,
    Preempted,
    TaskFailed,
    WorkerDied,
)
from tests.service.rounds import DONE, MAX_ATTEMPTS, Table, places
from tests.service.support import BOTH

pytestmark = BOTH


@pytest.fixture
def table(database: Database) -> Table:
    made = Table(database)
    made.add("a")
    return made


def failure(table: Table) -> tuple[str, str, bool]:
    found = table.job("a").failure
    assert found is not None
    return found["code"], found["message"], found["retryable"]


def costs(table: Table) -> list[tuple[int, float, int]]:
    """Each finished pass: its index, CPU seconds and camera rays."""
    passes = progress.finished_passes(table.render("a"))
    return [(each["pass_index"], each["cpu_seconds"], each["rays"]["camera"]) for each in passes]


def test_passes_are_handed_out_one_after_another(table: Table) -> None:
    steps = [places([table.next()])[0][1:] for _ in range(9)]
    assert steps == [(0, 0), *((1, tile) for tile in range(4)), *((2, tile) for tile in range(4))]


def test_new_job_shows_its_coarse_picture_first(table: Table) -> None:
    table.round(room=2)
    table.add("b")
    table.add("c")
    assert places(table.round(room=4).tasks) == [("b", 0, 0), ("c", 0, 0), ("a", 1, 0), ("a", 1, 1)]


def test_slots_are_filled_from_the_next_job(table: Table) -> None:
    table.add("b")
    table.round(room=2)
    assert len(table.round(room=8).tasks) == 8
    assert places(table.round(room=2).tasks) == [("b", 1, 0), ("b", 1, 1)]


def test_preempted_tile_is_charged_and_resumed(table: Table) -> None:
    task = table.next()
    assert not task.resumed
    for spent in (2.0, 4.0):
        table.round((task, Preempted(2.0)))
        assert table.served() == {"local": pytest.approx(spent)}
        assert table.render("a").cpu_seconds == spent
        task = table.next()
        assert (task.pass_.index, task.tile.index, task.resumed) == (0, 0, True)
    table.round((task, DONE))
    assert costs(table)[0][:2] == (0, 4.0 + DONE.cpu_seconds)


@pytest.mark.parametrize(("owner", "begun"), [("local", 4), ("bob", 2)])
def test_tile_of_two_users_waits_at_no_worker(table: Table, owner: str, begun: int) -> None:
    for name in "bcd":
        table.add(name, owner=owner)
    assert len(table.round(room=4, idle=2).tasks) == begun


def test_spare_worker_is_for_users_without_a_tile(table: Table) -> None:
    assert len(table.round(room=2).tasks) == 1
    assert table.round(spare=1).tasks == []
    table.add("b", owner="bob")
    assert [task.job for task in table.round(spare=1).tasks] == ["b"]
    assert table.round(spare=1).tasks == []


def test_result_counts_once(table: Table) -> None:
    task = table.next()
    table.round((task, DONE), (task, DONE))
    table.round((task, DONE))
    render = table.render()
    assert (render.done_steps, render.last_seq, render.cpu_seconds) == (1, 1, 0.5)
    assert (render.rays, render.work) == ({"camera": 3, "mirror": 0}, {"shading_points": 2})
    assert costs(table) == [(0, 0.5, 3)]


@pytest.mark.parametrize("ended", [Interrupted(), WorkerDied()])
def test_result_of_an_older_attempt_does_not_count(table: Table, ended: Outcome) -> None:
    stale = table.next()
    last = table.round((stale, ended))
    assert last.retries.total() == 1
    assert not table.release(last).retries
    fresh = table.next()
    assert places([fresh]) == places([stale])
    table.round((stale, DONE))
    assert not table.round((stale, WorkerDied())).retries
    assert (table.render().done_steps, costs(table)) == (0, [])
    table.round((fresh, DONE))
    assert (table.render().done_steps, costs(table)) == (1, [(0, 0.5, 3)])


@pytest.mark.parametrize("outcome", [DONE, WorkerDied(), TaskFailed("render_failed", "No.")])
def test_cancelled_render_ignores_results(table: Table, outcome: Outcome) -> None:
    task = table.next()
    table.cancel("a")
    assert table.round(leaving=["a"], room=5).tasks == []
    assert table.job("a").state is JobState.RUNNING
    result = table.round((task, outcome), leaving=["a"], room=5)
    assert (result.tasks, set(result.ended), dict(result.retries)) == ([], {"a"}, {})
    assert table.render().done_steps == 0
    assert table.job("a").state is JobState.CANCELLED


def test_tile_may_crash_three_workers(table: Table) -> None:
    retries, waits = Counter[str](), []
    for _ in range(MAX_ATTEMPTS):
        assert table.job("a").failure is None
        result = table.round((table.next(), WorkerDied()))
        retries += result.retries
        waits += [seconds for _, seconds in result.held]
        assert places(table.release(result).tasks) == []
    assert retries == {"worker_died": MAX_ATTEMPTS - 1}
    assert waits == [0.5, 2.0]
    code, message, retryable = failure(table)
    assert (code, "4 GiB of memory" in message, retryable) == ("worker_died", True, True)
    assert table.round(room=5).tasks == []


def test_crash_on_the_last_tile_gives_its_user_a_turn(table: Table) -> None:
    tasks = [task for _ in range(3) for task in table.round(room=20).tasks]
    assert len(tasks) == 9
    died = table.round((tasks[-1], WorkerDied()), room=20)
    # It waits, and nothing else is left.
    assert died.tasks == []
    assert places(table.release(died, room=20).tasks) == places(tasks[-1:])


def test_interruption_is_no_fault_of_a_task(table: Table) -> None:
    for _ in range(3 * MAX_ATTEMPTS):
        table.round((table.next(), Interrupted()))
    assert table.job("a").state is JobState.RUNNING


def test_failure_reaches_all_jobs_of_a_render(table: Table) -> None:
    table.join("a", "b", "other")
    result = table.round((table.next(), TaskFailed("render_failed", "Pixel 3 is lost.")))
    assert (result.news, result.ended) == ({"a", "b"}, {"a": JobState.FAILED})
    for job in (table.job("a"), table.job("b")):
        assert job.state is JobState.FAILED
        assert job.failure == {"code": "render_failed", "message": "Pixel 3 is lost.", "retryable": False}


def test_news_reach_all_jobs_of_a_render(table: Table) -> None:
    table.add("c")
    table.join("a", "b", "other")
    result = table.round(room=1)
    assert ([task.job for task in result.tasks], result.news) == (["a"], {"a", "b"})
    assert [table.job(name).state.value for name in "abc"] == ["running", "running", "queued"]


@pytest.mark.parametrize("code", ["storage_full", "storage_read_only"])
def test_store_that_takes_nothing_makes_jobs_wait(table: Table, code: str) -> None:
    task = table.next()
    result = table.round((task, TaskFailed(code, "Closed.")), room=5)
    assert (result.store_closed, result.tasks, dict(result.retries)) == (True, [], {code: 1})
    assert table.job("a").state is JobState.RUNNING
    assert places([table.next()]) == places([task])


def test_picture_is_composed_after_the_last_tile(table: Table) -> None:
    tasks = [table.next() for _ in range(9)]
    for task in tasks[:-1]:
        assert table.round((task, DONE)).tasks == []
    (compose,) = table.round((tasks[-1], DONE)).tasks
    assert isinstance(compose, ComposeTask)
    order = [(part.tile.index, part.pass_.index) for part in compose.parts]
    assert order == [(tile, pass_) for tile in range(4) for pass_ in (1, 2)]
    assert table.round(room=5).tasks == []
    error = {"estimate": 0.02, "low": 0.01, "high": 0.03}
    table.round((compose, ComposeDone("ab", {"clamped": 2}, {2: error})))
    render = table.render()
    assert (table.job("a").state, render.state) == (JobState.SUCCEEDED, JobState.SUCCEEDED)
    assert (render.image_sha256, render.numerics) == ("ab", {"retried": 1, "clamped": 2})
    assert [each["error"] for each in progress.finished_passes(render)] == [None, None, error]


@pytest.mark.parametrize(
    ("code", "reported"),
    [
        ("out_of_memory", ("out_of_memory", False)),
        ("took_too_long", ("took_too_long", False)),
        ("render_failed", ("storage_failed", True)),
    ],
)
def test_composition_that_fails_says_why(table: Table, code: str, reported: tuple[str, bool]) -> None:
    table.round((table.composing(), TaskFailed(code, "Too much.")))
    assert failure(table)[::2] == reported


def test_composition_is_tried_again_after_a_crash(table: Table) -> None:
    compose: JobTask = table.composing()
    # Attempts that failed because the disk was full do not count.
    for _ in range(MAX_ATTEMPTS):
        table.round((compose, TaskFailed("storage_full", "Full.")))
        (compose,) = table.round().tasks
    for _ in range(1, MAX_ATTEMPTS):
        result = table.round((compose, WorkerDied()))
        assert (result.tasks, result.retries) == ([], {"worker_died": 1})
        stale, (compose,) = compose, table.release(result).tasks
        table.round((stale, ComposeDone("stale", {})))
        assert table.job("a").state is JobState.RUNNING
    last = table.round((compose, WorkerDied()))
    assert (last.tasks, dict(last.retries)) == ([], {})
    assert failure(table)[::2] == ("worker_died", True)


def test_pass_is_reported_with_all_that_was_done_before(table: Table) -> None:
    tasks = [table.next() for _ in range(9)]
    table.round((tasks[0], DONE))
    # The last tile of pass 1 comes after one of pass 2.
    for place in (1, 2, 3, 5):
        table.round((tasks[place], DONE))
    assert costs(table) == [(0, 0.5, 3)]
    table.round((tasks[4], DONE))
    assert costs(table) == [(0, 0.5, 3), (1, 2.5, 15)]
    table.round(*((task, DONE) for task in tasks[6:]))
    assert costs(table) == [(0, 0.5, 3), (1, 2.5, 15), (2, 4.5, 27)]


def test_pass_does_not_end_before_an_earlier_one(table: Table) -> None:
    tasks = [table.next() for _ in range(9)]
    for task in (tasks[0], *tasks[5:]):
        table.round((task, DONE))
    assert [index for index, *_ in costs(table)] == [0]
    for task in tasks[1:5]:
        table.round((task, DONE))
    first, second, third = (each["seconds"] for each in progress.finished_passes(table.render()))
    assert first < second == third


def test_step_without_a_task_waits_again(table: Table) -> None:
    """After a transaction of which it is not known whether it was committed."""
    done, lost, flying = (table.next() for _ in range(3))
    table.round((done, DONE))
    with table.database.writing() as session:
        assert ledger.take_back_unknown(session, [flying]) == 1
    again = table.next()
    assert (again.tile, again.pass_, again.attempt) == (lost.tile, lost.pass_, lost.attempt + 1)
    assert table.next().attempt == 1


def test_restart_hands_out_what_ran(table: Table) -> None:
    first, second = table.next(), table.next()
    table.round((first, DONE))
    assert table.restart() == 1
    again = table.next()
    assert (places([again]), again.attempt) == (places([second]), second.attempt + 1)


def after_a_restart(table: Table) -> ComposeTask:
    table.flying = []
    with table.database.writing() as session:
        ledger.recover(session)
    (task,) = table.round().tasks
    assert isinstance(task, ComposeTask)
    return task


def test_picture_is_in_files_of_the_recorded_attempt(table: Table) -> None:
    attempts = [table.composing().attempt, after_a_restart(table).attempt]
    last = after_a_restart(table)
    assert [*attempts, last.attempt] == [1, 2, 3]
    table.round((last, ComposeDone("ab", {})))
    assert (table.render("a").image_sha256, table.render("a").final_prefix) == ("ab", "3-")


def test_lost_workers_are_counted_across_a_restart(table: Table) -> None:
    """Or a picture that kills each worker, and the service with the last of them, would do so for ever."""
    task = table.composing()
    for _ in range(1, MAX_ATTEMPTS):
        table.round((task, WorkerDied()))
        task = after_a_restart(table)
    assert table.round((task, WorkerDied())).tasks == []
    assert table.job("a").state is JobState.FAILED
