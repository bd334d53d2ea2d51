"""Paused jobs: no more of their tiles are started, and finished tiles stay."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import httpx2
import pytest
from sqlalchemy import event

from schemas.api.jobs import JobState
from service.cli.process import outcome
from service.client import AsyncClient, Client
from service.dispatch import adaptive_passes as targets
from service.lifecycle import sharing
from service.server import RunningServer
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import JobRow
from tests.service.support import enter, job_of, long_scene, submit, until, wait
from tests.service.test_ledger import DONE, Table, places


class PausableTable(Table):
    """The table of jobs, some of which pause, resume and share renders."""

    def pause(self, job_id: str) -> None:
        with self.database.writing() as session:
            sharing.pause(session, session.merge(self.job(job_id)))

    def resume(self, job_id: str) -> None:
        with self.database.writing() as session:
            sharing.resume(session, session.merge(self.job(job_id)))

    def join(self, job_id: str, other: str, owner: str) -> None:
        """Let a job of another user share the render of a job."""
        with self.database.writing() as session:
            job = enter(session, other, session.merge(self.render(job_id)), owner=owner)
            sharing.follow(session, job.render)

    def long_ago(self, seconds: float, *jobs: str) -> None:
        """Let everything that happened to these jobs have happened so much earlier."""
        with self.database.writing() as session:
            for row in [session.merge(found) for job in jobs for found in (self.job(job), self.render(job))]:
                for name in ("started_at", "paused_at"):
                    moment = getattr(row, name)
                    setattr(row, name, moment and moment - timedelta(seconds=seconds))


@pytest.fixture
def table(tmp_path: Path) -> Iterator[PausableTable]:
    database = Database(f"sqlite:///{tmp_path / 'test.sqlite'}")
    upgrade(database)
    yield PausableTable(database)
    database.close()


def test_what_is_in_hand_is_finished_and_nothing_follows_before_it_is_resumed(table: PausableTable) -> None:
    table.add("a")
    running = table.next()
    table.pause("a")
    assert table.round((running, DONE), room=4).tasks == []
    assert table.render("a").done_steps == 1
    table.resume("a")
    assert places(table.round(room=2).tasks) == [("a", 1, 0), ("a", 1, 1)]


def test_a_queued_job_that_is_paused_does_not_begin_and_others_do(table: PausableTable) -> None:
    table.add("a")
    table.add("b")
    table.pause("a")
    assert places(table.round(room=1).tasks) == [("b", 0, 0)]
    assert table.job("a").state is JobState.QUEUED


def test_a_shared_render_continues_while_one_of_its_jobs_does(table: PausableTable) -> None:
    table.add("a")
    table.round(room=1)
    table.join("a", "b", "another")
    table.pause("a")
    assert len(table.round(room=1).tasks) == 1
    assert table.render("a").paused_at is None
    table.pause("b")
    assert table.round(room=1).tasks == []
    assert table.render("a").paused_at is not None
    # A job that comes now needs it.
    table.join("a", "c", "third")
    assert len(table.round(room=1).tasks) == 1
    assert table.render("a").paused_at is None


def test_when_the_only_job_leaves_that_was_not_paused_the_render_pauses(table: PausableTable) -> None:
    table.add("a")
    table.round(room=1)
    table.join("a", "b", "another")
    table.pause("a")
    with table.database.writing() as session:
        sharing.leave_ended(session, session.merge(table.job("b")), JobState.CANCELLED)
    assert table.render("a").paused_at is not None
    assert table.round(room=1).tasks == []


def test_no_limit_of_time_runs_on_during_a_pause(table: PausableTable) -> None:
    table.add("a")
    table.round(room=1)
    with table.database.writing() as session:
        session.merge(table.job("a")).time_limit = 10
    table.long_ago(6, "a")
    table.pause("a")
    table.long_ago(100, "a")
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
    table.long_ago(4, "a")
    with table.database.writing() as session:
        assert [render.id for render in sharing.end_late(session)[0]] == ["a"]


def test_the_time_of_target_quality_waits_too(table: PausableTable) -> None:
    table.add("a")
    table.round(room=1)
    with table.database.writing() as session:
        session.merge(table.render("a")).time_limit = 10
    table.pause("a")
    table.long_ago(100, "a")
    table.resume("a")
    render = table.render("a")
    left = targets.time_left(render)
    assert left is not None
    assert 0 < left <= 10


def test_a_job_is_paused_and_resumed_over_http_by_all_clients(
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
