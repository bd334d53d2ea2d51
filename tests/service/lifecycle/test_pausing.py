"""Paused jobs: no more of their tiles are started, and no time limit runs on."""

import asyncio
from datetime import UTC, datetime, timedelta

import httpx2
import pytest
from sqlalchemy import event

from schemas.api.jobs import JobState
from service.cli.process import outcome
from service.client import AsyncClient, Client
from service.dispatch import adaptive_passes
from service.lifecycle import sharing
from service.lifecycle.documents import documents
from service.server import RunningServer
from service.storage.database.connection import Database
from service.storage.database.models import JobRow
from tests.service.rounds import DONE, Table, places
from tests.service.support import job_of, long_scene, submit, until, wait


class PausableTable(Table):
    """Jobs that pause and resume."""

    def pause(self, job_id: str) -> None:
        with self.database.writing() as session:
            sharing.pause(session, session.merge(self.job(job_id)))

    def resume(self, job_id: str) -> None:
        with self.database.writing() as session:
            sharing.resume(session, session.merge(self.job(job_id)))

    def started(self) -> int:
        return len(self.round(room=1).tasks)

    def long_ago(self, seconds: float) -> None:
        """Let everything that happened to job a have happened so much earlier."""
        with self.database.writing() as session:
            for row in (session.merge(self.job("a")), session.merge(self.render("a"))):
                for name in ("started_at", "paused_at"):
                    moment = getattr(row, name)
                    setattr(row, name, moment and moment - timedelta(seconds=seconds))


@pytest.fixture
def table(database: Database) -> PausableTable:
    made = PausableTable(database)
    made.add("a")
    return made


def test_running_tile_is_finished_and_none_follows(table: PausableTable) -> None:
    running = table.next()
    table.pause("a")
    assert table.round((running, DONE), room=4).tasks == []
    assert table.render("a").done_steps == 1
    table.resume("a")
    assert places(table.round(room=2).tasks) == [("a", 1, 0), ("a", 1, 1)]


def test_run_time_stands_still_in_a_pause(table: PausableTable) -> None:
    def run_seconds() -> float | None:
        with table.database.reading() as session:
            return documents(session, [session.merge(table.job("a"))])[0].run_seconds

    assert run_seconds() is None
    table.next()
    table.long_ago(100)
    table.pause("a")
    assert run_seconds() == pytest.approx(100, abs=20)
    table.long_ago(1000)
    assert run_seconds() == pytest.approx(100, abs=20)
    table.resume("a")
    table.long_ago(100)
    assert run_seconds() == pytest.approx(200, abs=20)
    table.pause("a")
    with table.database.writing() as session:
        session.merge(table.job("a")).finished_at = datetime.now(UTC) + timedelta(seconds=1000)
    assert run_seconds() == pytest.approx(200, abs=20)


def test_queued_job_that_is_paused_lets_others_pass(table: PausableTable) -> None:
    table.add("b")
    table.pause("a")
    assert places(table.round(room=1).tasks) == [("b", 0, 0)]
    assert table.job("a").state is JobState.QUEUED


def test_shared_render_pauses_with_its_last_job(table: PausableTable) -> None:
    table.next()
    table.join("a", "b", "another")
    table.pause("a")
    assert (table.started(), table.render("a").paused_at) == (1, None)
    table.pause("b")
    assert table.started() == 0
    assert table.render("a").paused_at is not None
    # A job that comes now needs it, and one that leaves does not.
    table.join("a", "c", "third")
    assert (table.started(), table.render("a").paused_at) == (1, None)
    with table.database.writing() as session:
        sharing.leave_ended(session, session.merge(table.job("c")), JobState.CANCELLED)
    assert table.render("a").paused_at is not None
    assert table.started() == 0


def test_time_limit_waits_during_a_pause(table: PausableTable) -> None:
    table.next()
    with table.database.writing() as session:
        session.merge(table.job("a")).time_limit = 10
        session.merge(table.render("a")).time_limit = 10
    table.long_ago(6)
    table.pause("a")
    table.long_ago(100)
    with table.database.writing() as session:
        assert sharing.end_late(session) == ([], [], None)
    table.resume("a")
    whole: list[object] = []

    def note(job: JobRow, _: object) -> None:
        whole.append(job)

    event.listen(JobRow, "load", note)
    with table.database.writing() as session:
        ended, _, upcoming = sharing.end_late(session)
    event.remove(JobRow, "load", note)
    # Every round checks all jobs with a limit, which may be thousands, without reading them whole.
    assert ended == whole == []
    assert upcoming is not None
    # Six of ten seconds had passed before the pause; this test takes some itself.
    assert 0 < upcoming <= 4
    left = adaptive_passes.time_left(table.render("a"))
    assert left is not None
    assert 0 < left <= 4
    table.long_ago(4)
    with table.database.writing() as session:
        assert [render.id for render in sharing.end_late(session)[0]] == ["a"]


def test_sleep_in_the_middle_of_a_round_is_no_time_of_a_job(table: PausableTable) -> None:
    table.next()
    with table.database.writing() as session:
        session.merge(table.job("a")).time_limit = 10
    table.long_ago(11)
    slept = table.round(begun_before=11)
    # The next round knows how long it was.
    assert (slept.ended, slept.deadline_in) == ({}, 0)
    assert table.round().ended == {"a": JobState.FAILED}


def test_job_is_paused_and_resumed_by_all_clients(
    client: httpx2.Client, server: RunningServer, capsys: pytest.CaptureFixture[str]
) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["last_seq"] > 0)
    with Client(server.url) as remote:
        held = remote.get(job).pause()
        assert (held.paused, held.state) == (True, "running")
        until(lambda: not remote.get(job).rendering)
        assert [entry.event for entry in remote.log(job).entries][-1] == "paused"
        assert not remote.get(job).resume().paused

    async def both() -> tuple[bool, bool]:
        async with AsyncClient(server.url) as remote:
            held = await (await remote.get(job)).pause()
            first = held.paused
            return first, (await held.resume()).paused

    assert asyncio.run(both()) == (True, False)
    for command, reported in (("pause", "running, paused"), ("resume", "running")):
        assert outcome([command, job, "--server", server.url]) == 0
        assert capsys.readouterr().err == f"Job {job}: {reported}\n"
    client.post(f"/v1/jobs/{job}/cancel")
    assert client.post(f"/v1/jobs/{job}/pause").json()["state"] == "cancelled"
    assert not job_of(client, job)["paused"]
