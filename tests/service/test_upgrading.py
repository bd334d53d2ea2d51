"""A database of an earlier release that has jobs in it, opened by this one."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import column, inspect, select, text
from sqlalchemy import table as sql_table
from uvicorn.config import STARTUP_FAILURE

from schemas.api.jobs import JobState
from service.cli.errors import ExitCode
from service.cli.process import outcome
from service.dispatch import ledger
from service.errors import DatabaseVersionError
from service.jobs import retention
from service.lifecycle import fairness, totals
from service.lifecycle.documents import documents
from service.storage.database.connection import Database
from service.storage.database.migrations import SCRIPTS, upgrade
from service.storage.database.models import AssetRow, JobRow, LabelRow, RenderRow, TileRow
from service.storage.folder import Folder
from service.storage.objects import Found
from service.storage.tiles import TileStore
from tests.service.support import BOTH

FIRST = "tables_0001"
MOMENT = "2026-01-02 03:04:05.000000"
RENDER = {
    "cancel_requested": False,
    "width": 64,
    "height": 32,
    "spec_sha256": "ab",
    "passes": json.dumps([{"index": 0, "stride": 8, "first": 0, "last": 1}]),
    "display": "{}",
    "layers": "[]",
    "total_steps": 2,
    "done_steps": 1,
    "total_work": 2**40,
    "done_work": 2**38,
    "last_seq": 1,
    "compose_attempt": 0,
    "predicted_cpu_seconds": 1.5,
    "cpu_seconds": 0.5,
    "rays": json.dumps({"camera": 32}),
    "work": "{}",
    "numerics": "{}",
    "merges": "[]",
    "counted_share": 0.0,
    "counted_work": 0,
    "pass_costs": "[]",
    "started_at": MOMENT,
    "paused_seconds": 0.0,
}
JOB = {
    "owner": "ann",
    "labels": json.dumps({"course": "cs171"}),
    "priority": 3,
    "quality": json.dumps({"mode": "fixed"}),
    "plan": json.dumps({"stages": []}),
    "warnings": "[]",
    "predicted_cpu_seconds": 1.5,
    "load": 1.5,
    "pinned": False,
    "created_at": MOMENT,
    "started_at": MOMENT,
    "paused_seconds": 0.0,
}
ASSET = {
    "sha256": "ab" * 32,
    "bytes": 1,
    "media_type": "image/png",
    "width": 1,
    "height": 1,
    "created_at": MOMENT,
    "used_at": MOMENT,
}
FAILURE = json.dumps({"code": "worker_died", "message": "It died.", "retryable": True})
TILE = {"render": 1, "pass_index": 0, "x0": 0, "y0": 0, "x1": 64, "y1": 32, "attempt": 1, "deaths": 2}

LATER = """
import sqlalchemy as sa
from alembic import op

revision = "tables_later"
down_revision = {head!r}


def upgrade() -> None:
    op.add_column("jobs", sa.Column("course", sa.String(length=64), nullable=False, server_default=""))
    op.execute("UPDATE jobs SET course = 'that of ' || owner")
    with op.batch_alter_table("tiles") as tiles:
        tiles.alter_column("deaths", new_column_name="losses")
"""

pytestmark = BOTH


@pytest.fixture
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """A database as the first release left it: one job that runs, and one that has failed."""
    sqlite = request.param == "sqlite"
    url = f"sqlite:///{tmp_path / 'old'}" if sqlite else request.getfixturevalue("postgres").database()
    database = Database(url)
    _make(database, FIRST)
    _insert(database, "renders", RENDER | {"id": "aa", "state": "running"})
    _insert(database, "renders", RENDER | {"id": "bb", "state": "failed"})
    _insert(database, "jobs", JOB | {"id": "aa", "name": "ball", "state": "running", "render_number": 1})
    _insert(database, "jobs", JOB | {"id": "bb", "state": "failed", "failure": FAILURE, "render_number": 2})
    _insert(database, "tiles", TILE | {"tile": 0, "state": "done", "seq": 1, "crc32": 2**32 - 1, "charge": 0})
    _insert(database, "tiles", TILE | {"tile": 1, "state": "waiting", "charge": 0})
    yield database
    database.close()


@pytest.fixture
def later(tmp_path: Path) -> Path:
    """The scripts of a later version, which has one migration more."""
    return _scripts(tmp_path / "later", LATER)


def _scripts(folder: Path, migration: str) -> Path:
    shutil.copytree(SCRIPTS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    head = ScriptDirectory(str(SCRIPTS)).get_current_head()
    (folder / "versions" / "tables_later.py").write_text(migration.format(head=head))
    return folder


def _make(database: Database, revision: str) -> None:
    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    with database.engine.execution_options(writes=True).begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, revision)


def _insert(database: Database, table: str, values: dict[str, object]) -> None:
    columns = [column(name) for name in values]
    with database.writing() as session:
        session.execute(sql_table(table, *columns).insert(), values)


def _columns(database: Database, table: str) -> set[str]:
    return {found["name"] for found in inspect(database.engine).get_columns(table)}


def test_jobs_are_described_as_before(database: Database) -> None:
    upgrade(database)
    with database.reading() as session:
        first, second = documents(session, session.scalars(select(JobRow).order_by(JobRow.number)).all())
    assert (first.id, first.name, first.state, first.width) == ("aa", "ball", JobState.RUNNING, 64)
    assert (first.progress.done, first.progress.total, first.progress.share) == (1, 2, 0.25)
    assert (first.cost.cpu_seconds, first.cost.rays, first.last_seq) == (0.5, {"camera": 32}, 1)
    assert (first.user, first.labels, first.priority) == ("ann", {"course": "cs171"}, 3)
    assert (second.id, second.state) == ("bb", JobState.FAILED)
    assert second.failure is not None
    assert second.failure.code == "worker_died"


def test_what_was_left_waiting_continues(database: Database) -> None:
    upgrade(database)
    with database.writing() as session:
        ledger.recover(session)
        (task,) = ledger.tile_claims(session, 4)
    assert (task.job, task.tile.index) == ("aa", 1)
    with database.reading() as session:
        done = session.get_one(TileRow, (1, 0, 0))
        assert (done.state, done.seq, done.crc32) == ("done", 1, 2**32 - 1)


def test_pictures_of_the_first_release_keep_the_names_of_their_files(database: Database) -> None:
    _insert(database, "renders", RENDER | {"id": "cc", "state": "succeeded", "image_sha256": "ab" * 32})
    upgrade(database)
    with database.reading() as session:
        prefixes = dict(session.execute(select(RenderRow.id, RenderRow.final_prefix)).all())
    assert prefixes == {"aa": "", "bb": "", "cc": ""}


def test_a_picture_that_the_first_release_was_composing_gets_the_next_number(database: Database) -> None:
    started = {"state": "running", "compose_attempt": 1, "total_steps": 1, "done_steps": 1}
    _insert(database, "renders", RENDER | started | {"id": "cc"})
    upgrade(database)
    with database.writing() as session:
        ledger.recover(session)
        (task,) = ledger.compose_claims(session, ())
    assert (task.job, task.attempt) == ("cc", 2)


def test_what_is_counted_since_is_filled_in_for_earlier_rows(database: Database) -> None:
    """Sums, places in the queue, and whose a label is: as if they had always been kept."""
    done = {"state": "succeeded", "image_sha256": "ab" * 32}
    for name in ("cc", "dd"):
        _insert(database, "renders", RENDER | done | {"id": name, "spec_sha256": name})
    _insert(database, "renders", RENDER | {"id": "ee", "state": "queued", "spec_sha256": "ee"})
    ended = {"state": "succeeded", "finished_at": MOMENT}
    _insert(database, "jobs", JOB | ended | {"id": "cc", "render_number": 3})
    _insert(database, "jobs", JOB | ended | {"id": "dd", "render_number": 4, "pinned": True})
    _insert(database, "jobs", JOB | {"id": "ee", "state": "queued", "render_number": 5, "started_at": None})
    _insert(database, "labels", {"job": 3, "name": "course", "value": "cs171"})
    _insert(database, "assets", ASSET)
    _insert(database, "asset_uses", {"render": 3, "sha256": ASSET["sha256"]})
    upgrade(database)
    with database.reading() as session:
        renders = {render.id: render for render in session.scalars(select(RenderRow))}
        jobs = {job.id: job for job in session.scalars(select(JobRow))}
        assert totals.failed(session) == {"worker_died": 1}
        assert session.scalars(select(LabelRow.owner)).all() == ["ann"]
        assert session.scalars(select(AssetRow.renders)).all() == [1]
        assert fairness.positions(session, jobs.values()) == {5: 0}
    assert jobs["ee"].coarse_cpu_seconds == fairness.coarse_cpu_seconds(renders["ee"]) > 0
    assert renders["cc"].idle_since == jobs["cc"].finished_at
    assert [name for name, render in renders.items() if render.idle_since] == ["cc"]


def test_sizes_of_earlier_pictures_are_asked_of_the_store_once(database: Database, tmp_path: Path) -> None:
    class Counting(Folder):
        """A folder that counts how often it is listed."""

        listed = 0

        def found(self, prefix: str = "") -> Iterator[Found]:
            Counting.listed += 1
            return super().found(prefix)

    _insert(database, "renders", RENDER | {"id": "cc", "state": "succeeded", "image_sha256": "ab" * 32})
    store = TileStore(Counting(tmp_path / "jobs"))
    store.put_spec("cc", b"spec")
    store.put_file("cc", "image.npy", bytes(1000))
    upgrade(database)
    for _ in range(2):
        retention.measure(database, store)
    with database.reading() as session:
        sizes = dict(session.execute(select(RenderRow.id, RenderRow.stored_bytes)).all())
        assert totals.read(session, totals.STORED_BYTES) == sizes["cc"] == 1004
    assert Counting.listed == 1


def test_a_later_migration_changes_tables_and_keeps_rows(database: Database, later: Path) -> None:
    for _ in range(2):
        upgrade(database, later)
        with database.reading() as session:
            courses = session.execute(text("SELECT id, course FROM jobs ORDER BY id")).all()
            losses = session.scalars(text("SELECT losses FROM tiles")).all()
        assert [tuple(row) for row in courses] == [("aa", "that of ann"), ("bb", "that of ann")]
        assert list(losses) == [2, 2]


def test_a_migration_that_fails_leaves_all_as_it_was(database: Database, tmp_path: Path) -> None:
    before = _columns(database, "jobs")
    with pytest.raises(ZeroDivisionError):
        upgrade(database, _scripts(tmp_path / "failing", LATER + "    1 / 0\n"))
    assert _columns(database, "jobs") == before
    assert "losses" not in _columns(database, "tiles")
    upgrade(database)


def test_a_database_that_has_had_all_migrations_loads_nothing_to_run_them(database: Database) -> None:
    url = database.engine.url.render_as_string(hide_password=False)
    script = (
        "import sys\n"
        "from service.storage.database.connection import Database\n"
        "from service.storage.database.migrations import upgrade\n"
        f"upgrade(Database({url!r}))\n"
        "print('alembic' in sys.modules)\n"
    )
    lines = [sys.executable, "-c", script]
    runs = [subprocess.run(lines, check=True, capture_output=True, text=True).stdout for _ in range(2)]
    assert runs == ["True\n", "False\n"]


def test_the_tables_of_a_later_version_are_refused_and_kept(database: Database, later: Path) -> None:
    upgrade(database, later)
    with pytest.raises(DatabaseVersionError, match=r"\(tables_later\)"):
        upgrade(database)
    assert "course" in _columns(database, "jobs")


def test_a_service_does_not_start_on_the_tables_of_a_later_version(
    database: Database, later: Path, tmp_path: Path
) -> None:
    upgrade(database, later)
    url = database.engine.url.render_as_string(hide_password=False)
    settings = {"PENUMBRA_DATA": str(tmp_path / "data"), "PENUMBRA_DATABASE": url, "PENUMBRA_PORT": "0"}
    ended = subprocess.run(
        [sys.executable, "-m", "service"],
        env=os.environ | settings,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ended.returncode == STARTUP_FAILURE
    assert "not started" in ended.stderr
    assert "later version" in ended.stderr
    assert "course" in _columns(database, "jobs")


def test_the_doctor_names_the_tables_of_a_later_version(
    database: Database,
    later: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    upgrade(database, later)
    monkeypatch.setenv("PENUMBRA_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("PENUMBRA_DATABASE", database.engine.url.render_as_string(hide_password=False))
    assert outcome(["doctor"]) != ExitCode.DONE
    assert "A later version of the service" in capsys.readouterr().out


@pytest.mark.parametrize("version", ["0001", "0017"])
def test_a_database_from_before_the_first_release_is_refused_with_a_cure(
    database: Database, version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = :version"), {"version": version})
    with pytest.raises(DatabaseVersionError, match=rf"\({version}\).*empty data folder"):
        upgrade(database)
    url = database.engine.url.render_as_string(hide_password=False)
    assert outcome(["keys", "ls", "--data", str(tmp_path), "--database", url]) == ExitCode.USAGE
    assert "first release" in capsys.readouterr().err
