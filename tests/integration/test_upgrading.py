"""A database of an earlier version that has jobs in it, opened by this one."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import column, select
from sqlalchemy import table as sql_table

from schemas.jobs import JobState
from service.dispatch import ledger
from service.jobs import uploads
from service.lifecycle.documents import documents
from service.storage.database import migrations
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import AssetOwnerRow, JobRow, RenderRow, TileRow
from tests.integration.support import BOTH

MOMENT = "2026-01-02 03:04:05.000000"
JOB = {
    "cancel_requested": False,
    "width": 64,
    "height": 32,
    "spec_sha256": "ab",
    "passes": json.dumps([{"index": 0, "stride": 8, "first": 0, "last": 1}]),
    "display": "{}",
    "plan": json.dumps({"stages": []}),
    "warnings": "[]",
    "total_steps": 2,
    "done_steps": 1,
    "total_work": 40,
    "done_work": 10,
    "last_seq": 1,
    "compose_attempt": 0,
    "predicted_cpu_seconds": 1.5,
    "cpu_seconds": 0.5,
    "rays": json.dumps({"camera": 32}),
    "created_at": MOMENT,
    "started_at": MOMENT,
}
TILE = {"job": 5, "pass_index": 0, "x0": 0, "y0": 0, "x1": 64, "y1": 32, "attempt": 1, "deaths": 0}


pytestmark = BOTH


@pytest.fixture
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """A database as the first release left it: one job that runs, and one that has failed."""
    sqlite = request.param == "sqlite"
    url = (
        f"sqlite:///{tmp_path / 'test.sqlite'}" if sqlite else request.getfixturevalue("postgres").database()
    )
    database = Database(url)
    _upgrade_to(database, "0001")
    failure = json.dumps({"code": "worker_died", "message": "It died.", "retryable": True})
    _insert(database, "jobs", JOB | {"number": 5, "id": "aa", "name": "ball", "state": "running"})
    _insert(database, "jobs", JOB | {"number": 7, "id": "bb", "state": "failed", "failure": failure})
    _insert(database, "tiles", TILE | {"tile": 0, "state": "done", "seq": 1, "crc32": 2**32 - 1})
    _insert(database, "tiles", TILE | {"tile": 1, "state": "waiting"})
    yield database
    database.close()


def _upgrade_to(database: Database, version: str, *, back: bool = False) -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(migrations.__file__).parent))
    with database.engine.execution_options(writes=True, silence_ms=60_000).begin() as connection:
        config.attributes["connection"] = connection
        (command.downgrade if back else command.upgrade)(config, version)


def _insert(database: Database, table: str, values: dict[str, object]) -> None:
    columns = [column(name) for name in values]
    with database.writing() as session:
        session.execute(sql_table(table, *columns).insert(), values)


def test_jobs_are_told_as_before(database: Database) -> None:
    upgrade(database)
    with database.reading() as session:
        first, second = documents(session, session.scalars(select(JobRow)).all())
    assert (first.id, first.name, first.state, first.width) == ("aa", "ball", JobState.RUNNING, 64)
    assert (first.progress.done, first.progress.total, first.progress.share) == (1, 2, 0.25)
    assert (first.cost.cpu_seconds, first.cost.rays, first.last_seq) == (0.5, {"camera": 32}, 1)
    assert (second.id, second.state) == ("bb", JobState.FAILED)
    assert second.failure is not None
    assert second.failure.code == "worker_died"
    assert (first.user, first.labels, first.priority) == ("local", {}, 0)


def test_every_job_has_a_render_of_its_own_under_its_name(database: Database) -> None:
    upgrade(database)
    with database.reading() as session:
        jobs = {row.id: row.render for row in session.scalars(select(JobRow))}
        steps = session.scalars(select(TileRow).order_by(TileRow.tile)).all()
    assert {name: render and render.id for name, render in jobs.items()} == {"aa": "aa", "bb": "bb"}
    assert [(step.tile, step.state, step.seq, step.crc32) for step in steps] == [
        (0, "done", 1, 2**32 - 1),
        (1, "waiting", None, None),
    ]
    assert {step.render for step in steps} == {render.number for render in jobs.values() if render} - {7}


def test_what_was_left_waiting_goes_on(database: Database) -> None:
    upgrade(database)
    with database.writing() as session:
        ledger.recover(session)
        (task,) = ledger.tile_claims(session, 4)
    assert (task.job, task.tile.index) == ("aa", 1)


def test_numbers_go_on_after_those_that_were_given(database: Database) -> None:
    upgrade(database)
    with database.writing() as session:
        render = session.scalars(select(RenderRow).where(RenderRow.id == "bb")).one()
        fields = {column.key: getattr(render, column.key) for column in RenderRow.__table__.columns}
        added = RenderRow(**fields | {"number": None, "id": "cc"})
        session.add(added)
        session.flush()
        assert added.number == 8


def test_assets_belong_to_those_whose_jobs_name_them(database: Database) -> None:
    """Where keys were made; where there were none, all that was uploaded is the one user's."""
    for keys_made, unnamed in ((True, set()), (False, {("local", "cd" * 32)})):
        _upgrade_to(database, "0010")
        picture = {"bytes": 1, "media_type": "image/png", "width": 1, "height": 1, "created_at": MOMENT}
        for sha256 in ("ab" * 32, "cd" * 32):
            _insert(database, "assets", picture | {"sha256": sha256})
        body = zlib.compress(f'{{"asset":"sha256:{"ab" * 32}","other": "sha256:{"ef" * 32}"}}'.encode())
        _insert(database, "requests", {"job": 5, "body": body})
        if keys_made:
            key = {"id": "k", "secret_sha256": "", "user": "ann", "role": "submit", "created_at": MOMENT}
            _insert(database, "api_keys", key)
        upgrade(database)
        with database.reading() as session:
            rows = session.scalars(select(AssetOwnerRow)).all()
        assert {(row.owner, row.sha256) for row in rows} == {("local", "ab" * 32)} | unnamed
        _upgrade_to(database, "0010", back=True)
        for table in ("requests", "assets", "api_keys"):
            with database.writing() as session:
                session.execute(sql_table(table).delete())


def test_assets_that_old_pictures_need_are_kept_and_others_go(database: Database) -> None:
    """Where the request of a job is known, what it names; where it is not, all there is."""
    _upgrade_to(database, "0010")
    picture = {"bytes": 1, "media_type": "image/png", "width": 1, "height": 1, "created_at": MOMENT}
    for sha256 in ("ab" * 32, "cd" * 32):
        _insert(database, "assets", picture | {"sha256": sha256})
    _insert(database, "requests", {"job": 5, "body": zlib.compress(f'"sha256:{"ab" * 32}"'.encode())})
    upgrade(database)
    now = datetime.now(UTC)
    with database.writing() as session:
        assert uploads.drop_unused(session, now, 9) == {}
        session.delete(session.scalars(select(JobRow).where(JobRow.id == "bb")).one())
        session.flush()
        session.delete(session.scalars(select(RenderRow).where(RenderRow.id == "bb")).one())
        assert uploads.drop_unused(session, now, 9) == {"cd" * 32: 1}
        assert not any(row.pinned for row in session.scalars(select(JobRow)))
