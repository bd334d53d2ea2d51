"""Attempts to compose a picture: no number is given twice, and only the newest counts. No engine."""

from __future__ import annotations

import pytest

from schemas.api.jobs import JobState
from service.dispatch import ledger
from service.storage.database.connection import Database
from service.workers.tasks import ComposeDone, ComposeTask, Interrupted, Outcome, TaskFailed, WorkerDied
from tests.service.rounds import DONE, MAX_ATTEMPTS, Table
from tests.service.support import BOTH

pytestmark = BOTH


@pytest.fixture
def table(database: Database) -> Table:
    return Table(database)


def composing(table: Table) -> ComposeTask:
    """Finish all tiles of job a."""
    table.add("a")
    (task,) = table.round(*((table.next(), DONE) for _ in range(9))).tasks
    assert isinstance(task, ComposeTask)
    return task


def after_a_restart(table: Table) -> ComposeTask:
    table.flying = []
    with table.database.writing() as session:
        ledger.recover(session)
    (task,) = table.round().tasks
    assert isinstance(task, ComposeTask)
    return task


def test_the_picture_is_in_files_of_the_attempt_that_is_recorded(table: Table) -> None:
    attempts = [composing(table).attempt, after_a_restart(table).attempt]
    last = after_a_restart(table)
    assert [*attempts, last.attempt] == [1, 2, 3]
    table.round((last, ComposeDone("ab", {})))
    assert (table.render("a").image_sha256, table.render("a").final_prefix) == ("ab", "3-")


@pytest.mark.parametrize(
    "outcome",
    [
        ComposeDone("stale", {}),
        TaskFailed("out_of_memory", "It needs more."),
        TaskFailed("render_failed", "It stopped."),
        WorkerDied(),
        Interrupted(),
    ],
    ids=lambda outcome: type(outcome).__name__,
)
def test_no_outcome_of_an_earlier_attempt_counts(table: Table, outcome: Outcome) -> None:
    stale = composing(table)
    newest = after_a_restart(table)
    for _ in range(MAX_ATTEMPTS):
        result = table.round((stale, outcome))
        assert (result.tasks, not result.retries) == ([], True)
    assert table.job("a").state is JobState.RUNNING
    table.round((newest, ComposeDone("ab", {})))
    assert (table.job("a").state, table.render("a").image_sha256) == (JobState.SUCCEEDED, "ab")


def test_workers_that_a_picture_has_cost_are_counted_across_a_restart(table: Table) -> None:
    """Or a picture that kills each worker, and the service with the last of them, would do so for ever."""
    task = composing(table)
    for _ in range(1, MAX_ATTEMPTS):
        table.round((task, WorkerDied()))
        task = after_a_restart(table)
    assert table.round((task, WorkerDied())).tasks == []
    assert table.job("a").state is JobState.FAILED
