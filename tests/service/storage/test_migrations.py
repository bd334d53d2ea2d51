"""A database of the first release that has jobs in it, opened by this one."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
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
from service.storage.database.models import AssetRow, Base, JobRow, LabelRow, RenderRow, TileRow
from service.storage.folder import Folder
from service.storage.objects import Found
from service.storage.tiles import TileStore
from tests.service.first_release import make_first
from tests.service.support import BOTH

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
SIZE = {"bytes": 1, "media_type": "image/png", "width": 1, "height": 1}
ASSET = {"sha256": "ab" * 32, "created_at": MOMENT, "used_at": MOMENT, **SIZE}
DONE = {"state": "succeeded", "image_sha256": "ab" * 32}
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


@pytest.fixture
def old(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """A database as the first release left it: one job that runs, and one that has failed."""
    sqlite = request.param == "sqlite"
    url = f"sqlite:///{tmp_path / 'old'}" if sqlite else request.getfixturevalue("postgres").database()
    database = Database(url)
    with database.engine.execution_options(writes=True).begin() as connection:
        make_first(connection)
    insert(database, "renders", RENDER | {"id": "aa", "state": "running"})
    insert(database, "renders", RENDER | {"id": "bb", "state": "failed"})
    insert(database, "jobs", JOB | {"id": "aa", "name": "ball", "state": "running", "render_number": 1})
    insert(database, "jobs", JOB | {"id": "bb", "state": "failed", "failure": FAILURE, "render_number": 2})
    insert(database, "tiles", TILE | {"tile": 0, "state": "done", "seq": 1, "crc32": 2**32 - 1, "charge": 0})
    insert(database, "tiles", TILE | {"tile": 1, "state": "waiting", "charge": 0})
    yield database
    database.close()


ON_BOTH = pytest.mark.parametrize("old", ["sqlite", "postgresql"], indirect=True)
ON_SQLITE = pytest.mark.parametrize("old", ["sqlite"], indirect=True)


def insert(database: Database, table: str, values: dict[str, object]) -> None:
    columns = [column(name) for name in values]
    with database.writing() as session:
        session.execute(sql_table(table, *columns).insert(), values)


def columns_of(database: Database, table: str) -> set[str]:
    return {found["name"] for found in inspect(database.engine).get_columns(table)}


def scripts(folder: Path, migration: str) -> Path:
    shutil.copytree(SCRIPTS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    head = ScriptDirectory(str(SCRIPTS)).get_current_head()
    (folder / "versions" / "tables_later.py").write_text(migration.format(head=head))
    return folder


@pytest.fixture
def later(tmp_path: Path) -> Path:
    """The scripts of a later version, which has one migration more."""
    return scripts(tmp_path / "later", LATER)


def test_migrations_have_the_names_of_their_files_in_order() -> None:
    """Where the last one has been run, a service looks no further."""
    revisions = [script.revision for script in ScriptDirectory(str(SCRIPTS)).walk_revisions()]
    files = [path.stem for path in SCRIPTS.glob("versions/*.py") if path.stem != "__init__"]
    assert revisions == sorted(files, reverse=True)


@BOTH
def test_migrations_build_the_tables_of_the_models(
    database: Database, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with database.engine.connect() as connection:
        # Alembic compares no order and no condition of an index.
        options = {"compare_type": True, "include_object": lambda _, name, *__: name != "ix_jobs_queue"}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, Base.metadata) == []
    url = request.getfixturevalue("postgres").database() if database.shared else f"sqlite:///{tmp_path}/made"
    made = Database(url)
    for index in chain.from_iterable(table.indexes for table in Base.metadata.tables.values()):
        index.dialect_options["postgresql"]["where"] = index.dialect_options["sqlite"]["where"]
    Base.metadata.create_all(made.engine)
    expected, found = indices(made), indices(database)
    made.close()
    assert {one for one in found if "alembic" not in one} == expected


def indices(database: Database) -> set[str]:
    """What makes each index, whatever stands between the words; its name where a table makes it."""
    asked = "indexname, indexdef FROM pg_indexes WHERE schemaname = 'public'"
    if not database.shared:
        asked = "name, sql FROM sqlite_master WHERE type = 'index'"
    with database.reading() as session:
        found = session.execute(text(f"SELECT {asked}")).all()
    return {name if "pk" in name else " ".join((made or name).split()) for name, made in found}


@ON_BOTH
def test_jobs_are_described_as_before_and_continue(old: Database) -> None:
    upgrade(old)
    with old.reading() as session:
        first, second = documents(session, session.scalars(select(JobRow).order_by(JobRow.number)).all())
    assert (first.id, first.name, first.state, first.width) == ("aa", "ball", JobState.RUNNING, 64)
    assert (first.progress.done, first.progress.total, first.progress.share) == (1, 2, 0.25)
    assert (first.cost.cpu_seconds, first.cost.rays, first.last_seq) == (0.5, {"camera": 32}, 1)
    assert (first.user, first.labels, first.priority) == ("ann", {"course": "cs171"}, 3)
    assert (second.id, second.state) == ("bb", JobState.FAILED)
    assert second.failure is not None
    assert second.failure.code == "worker_died"
    with old.writing() as session:
        ledger.recover(session)
        (task,) = ledger.tile_claims(session, 4)
    assert (task.job, task.tile.index) == ("aa", 1)
    with old.reading() as session:
        done = session.get_one(TileRow, (1, 0, 0))
        assert (done.state, done.seq, done.crc32) == ("done", 1, 2**32 - 1)


@ON_BOTH
def test_pictures_keep_their_files_and_get_the_next_number(old: Database) -> None:
    composing = {"state": "running", "compose_attempt": 1, "total_steps": 1, "done_steps": 1}
    insert(old, "renders", RENDER | DONE | {"id": "cc"})
    insert(old, "renders", RENDER | composing | {"id": "dd"})
    upgrade(old)
    with old.reading() as session:
        prefixes = dict(session.execute(select(RenderRow.id, RenderRow.final_prefix)).all())
    assert prefixes == dict.fromkeys(("aa", "bb", "cc", "dd"), "")
    with old.writing() as session:
        ledger.recover(session)
        (task,) = ledger.compose_claims(session, ())
    assert (task.job, task.attempt) == ("dd", 2)


@ON_BOTH
def test_later_columns_are_filled_for_earlier_rows(old: Database) -> None:
    """Sums, places in the queue, and whose a label is: as if they had always been kept."""
    for name in ("cc", "dd"):
        insert(old, "renders", RENDER | DONE | {"id": name, "spec_sha256": name})
    insert(old, "renders", RENDER | {"id": "ee", "state": "queued", "spec_sha256": "ee"})
    ended = {"state": "succeeded", "finished_at": MOMENT}
    insert(old, "jobs", JOB | ended | {"id": "cc", "render_number": 3})
    insert(old, "jobs", JOB | ended | {"id": "dd", "render_number": 4, "pinned": True})
    insert(old, "jobs", JOB | {"id": "ee", "state": "queued", "render_number": 5, "started_at": None})
    insert(old, "labels", {"job": 3, "name": "course", "value": "cs171"})
    insert(old, "assets", ASSET)
    insert(old, "asset_uses", {"render": 3, "sha256": ASSET["sha256"]})
    upgrade(old)
    with old.reading() as session:
        renders = {render.id: render for render in session.scalars(select(RenderRow))}
        jobs = {job.id: job for job in session.scalars(select(JobRow))}
        assert totals.failed(session) == {"worker_died": 1}
        assert session.scalars(select(LabelRow.owner)).all() == ["ann"]
        assert session.scalars(select(AssetRow.renders)).all() == [1]
        assert fairness.positions(session, jobs.values()) == {5: 0}
    assert jobs["ee"].coarse_cpu_seconds == fairness.coarse_cpu_seconds(renders["ee"]) > 0
    assert renders["cc"].idle_since == jobs["cc"].finished_at
    assert [name for name, render in renders.items() if render.idle_since] == ["cc"]


class Counting(Folder):
    """A folder that counts how often it is listed."""

    listed = 0

    def found(self, prefix: str = "") -> Iterator[Found]:
        Counting.listed += 1
        return super().found(prefix)


@ON_BOTH
def test_sizes_of_earlier_pictures_are_measured_once(old: Database, tmp_path: Path) -> None:
    insert(old, "renders", RENDER | DONE | {"id": "cc"})
    Counting.listed = 0
    store = TileStore(Counting(tmp_path / "jobs"))
    store.put_spec("cc", b"spec")
    store.put_file("cc", "image.npy", bytes(1000))
    upgrade(old)
    for _ in range(2):
        retention.measure(old, store)
    with old.reading() as session:
        sizes = dict(session.execute(select(RenderRow.id, RenderRow.stored_bytes)).all())
        assert totals.read(session, totals.STORED_BYTES) == sizes["cc"] == 1004
    assert Counting.listed == 1


@ON_BOTH
def test_later_migration_keeps_rows_and_a_failed_one_all(old: Database, later: Path, tmp_path: Path) -> None:
    before = columns_of(old, "jobs")
    with pytest.raises(ZeroDivisionError):
        upgrade(old, scripts(tmp_path / "failing", LATER + "    1 / 0\n"))
    assert columns_of(old, "jobs") == before
    assert "losses" not in columns_of(old, "tiles")
    for _ in range(2):
        upgrade(old, later)
        with old.reading() as session:
            courses = session.execute(text("SELECT id, course FROM jobs ORDER BY id")).all()
            losses = session.scalars(text("SELECT losses FROM tiles")).all()
        assert [tuple(row) for row in courses] == [("aa", "that of ann"), ("bb", "that of ann")]
        assert list(losses) == [2, 2]


@ON_SQLITE
def test_migrated_database_loads_no_alembic(old: Database) -> None:
    url = old.engine.url.render_as_string(hide_password=False)
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


@ON_BOTH
def test_tables_of_a_later_version_are_refused(
    old: Database,
    later: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    upgrade(old, later)
    with pytest.raises(DatabaseVersionError, match=r"\(tables_later\)"):
        upgrade(old)
    monkeypatch.setenv("PENUMBRA_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("PENUMBRA_DATABASE", old.engine.url.render_as_string(hide_password=False))
    monkeypatch.setenv("PENUMBRA_PORT", "0")
    assert outcome(["doctor"]) != ExitCode.DONE
    assert "A later version of the service" in capsys.readouterr().out
    ended = subprocess.run(
        [sys.executable, "-m", "service"], capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == STARTUP_FAILURE
    assert "later version" in ended.stderr
    assert "course" in columns_of(old, "jobs")


@ON_SQLITE
@pytest.mark.parametrize("version", ["0001", "0017"])
def test_tables_from_before_the_first_release_are_refused(
    old: Database, version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with old.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = :version"), {"version": version})
    with pytest.raises(DatabaseVersionError, match=rf"\({version}\).*empty data folder"):
        upgrade(old)
    url = old.engine.url.render_as_string(hide_password=False)
    assert outcome(["keys", "ls", "--data", str(tmp_path), "--database", url]) == ExitCode.USAGE
    assert "first release" in capsys.readouterr().err
