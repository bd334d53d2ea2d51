"""Steps whose files are damaged are handed out again, a few times. No engine."""

import itertools

import pytest
from sqlalchemy import select

from schemas.api.jobs import JobState
from service.lifecycle import progress
from service.storage.database.connection import Database
from service.storage.database.models import TileRow
from service.workers.tasks import (
    AdvanceTask,
    ComposeDone,
    ComposeTask,
    InputDamaged,
    JobTask,
    SampleTask,
    TaskFailed,
)
from tests.service.dispatch.test_adaptive_passes import DONE as SAMPLED
from tests.service.dispatch.test_adaptive_passes import Targets, advanced
from tests.service.rounds import DONE, MAX_ATTEMPTS, Table, places
from tests.service.support import BOTH

pytestmark = BOTH


@pytest.fixture
def table(database: Database) -> Targets:
    return Targets(database)


def numbers(table: Table) -> list[int]:
    """The numbers of the events that there are."""
    with table.database.reading() as session:
        return [*session.scalars(select(TileRow.seq).where(TileRow.seq.is_not(None)).order_by(TileRow.seq))]


def test_damaged_tiles_are_handed_out_before_the_picture_is_composed(table: Targets) -> None:
    table.add("a")
    compose: JobTask = table.composing()
    result = table.round((compose, InputDamaged(((1, 2), (2, 0)))), room=8)
    assert dict(result.retries) == {"storage_damaged": 1}
    assert places(result.tasks) == [("a", 1, 2), ("a", 2, 0)]
    assert [cost["pass_index"] for cost in progress.finished_passes(table.render())] == [0]
    (again,) = table.round(*((task, DONE) for task in result.tasks)).tasks
    assert isinstance(again, ComposeTask)
    assert (again.attempt, len(again.parts)) == (2, 8)
    assert {part.attempt for part in again.parts} == {1, 2}
    assert (table.render().done_steps, numbers(table)[-2:]) == (9, [10, 11])
    assert len([*progress.finished_passes(table.render())]) == 3
    table.round((again, ComposeDone("ab", {})))
    assert table.render().state is JobState.SUCCEEDED


@pytest.mark.parametrize("steps", [((1, 2),), ()], ids=["a tile", "read well again"])
def test_damage_that_returns_fails_the_job(table: Targets, steps: tuple[tuple[int, int], ...]) -> None:
    table.add("a")
    compose: JobTask = table.composing()
    for _ in range(MAX_ATTEMPTS):
        found = table.round((compose, InputDamaged(steps)), room=8).tasks
        if steps:
            (found,) = [table.round(*((task, DONE) for task in found)).tasks]
        [compose] = found
    table.round((compose, InputDamaged(steps)))
    failure = table.job("a").failure
    assert failure is not None
    assert (failure["code"], failure["retryable"]) == ("storage_failed", True)


def test_damaged_request_fails_the_job_at_once(table: Targets) -> None:
    table.add("a")
    table.round((table.next(), TaskFailed("request_damaged", "It is damaged.")))
    failure = table.job("a").failure
    assert failure is not None
    assert (failure["code"], failure["retryable"]) == ("request_damaged", True)


def test_pass_whose_files_are_damaged_is_merged_again(table: Targets) -> None:
    table.add_target()
    table.merge(advanced(1, 2))
    table.merge(advanced(1, 2, 3))
    before = numbers(table)
    damaged, finished, running = table.tasks()
    # The newest pass was merged from what is still there.
    (merge,) = table.tasks((finished, SAMPLED), (damaged, InputDamaged(merged=True)))
    assert isinstance(merge, AdvanceTask)
    assert (merge.pass_.index, [part.tile.index for part in merge.parts]) == (1, [1, 2])
    again = table.tasks((merge, advanced(1, 2, 3)))
    # A late result of a task from before counts no more, and its files have other names.
    table.tasks((running, SAMPLED), room=0)
    used = {task.attempt for task in (damaged, finished, running) if isinstance(task, SampleTask)}
    for task in again:
        assert isinstance(task, SampleTask)
        assert (task.pass_.index, task.merged) == (2, merge.attempt)
        assert task.attempt > max(used)
    (last,) = table.tasks(*((task, SAMPLED) for task in again))
    assert numbers(table)[: len(before) - 1] == before[:-1]
    assert all(first < second for first, second in itertools.pairwise(numbers(table)))
    table.tasks((last, advanced(final=True)))
    render = table.render()
    assert render.state is JobState.SUCCEEDED
    assert render.done_steps == render.total_steps


def test_layers_of_the_first_pass_are_recorded_again(table: Targets) -> None:
    table.add_target(time_limit=1000.0)
    table.merge(advanced(1, 2))
    merge = table.merging()
    (task,) = table.tasks((merge, InputDamaged(((0, 3),))))
    assert isinstance(task, SampleTask)
    assert (task.pass_.index, task.tile.index, task.merged, task.seconds_left) == (0, 3, 0, None)
    (again,) = table.tasks((task, SAMPLED))
    assert isinstance(again, AdvanceTask)
    assert (again.pass_, again.parts) == (merge.pass_, merge.parts)
