"""Attempts to compose a picture: no number is given twice, and only the newest counts. No engine."""

import pytest

from schemas.api.jobs import JobState
from service.dispatch import ledger
from service.storage.database.connection import Database
from service.workers.tasks import ComposeDone, ComposeTask, WorkerDied
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


def test_picture_is_in_files_of_the_recorded_attempt(table: Table) -> None:
    attempts = [composing(table).attempt, after_a_restart(table).attempt]
    last = after_a_restart(table)
    assert [*attempts, last.attempt] == [1, 2, 3]
    table.round((last, ComposeDone("ab", {})))
    assert (table.render("a").image_sha256, table.render("a").final_prefix) == ("ab", "3-")


def test_lost_workers_are_counted_across_a_restart(table: Table) -> None:
    """Or a picture that kills each worker, and the service with the last of them, would do so for ever."""
    task = composing(table)
    for _ in range(1, MAX_ATTEMPTS):
        table.round((task, WorkerDied()))
        task = after_a_restart(table)
    assert table.round((task, WorkerDied())).tasks == []
    assert table.job("a").state is JobState.FAILED
