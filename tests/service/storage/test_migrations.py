"""A database of the first release that has jobs in it, opened by this one."""

import hashlib
import shutil
import subprocess
import sys
import zlib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, select, text
from uvicorn.config import STARTUP_FAILURE

from schemas.api.jobs import JobState
from service.cli.errors import ExitCode
from service.cli.process import outcome
from service.errors import DatabaseVersionError
from service.lifecycle import fairness, totals
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import SCRIPTS, upgrade
from service.storage.database.migrations.versions.tables_0001 import METADATA
from service.storage.database.models import AssetRow, Base, JobRow, LabelRow, RenderRow, RequestRow
from service.storage.folder import Folder
from service.storage.objects import Found
from tests.service.conftest import Start
from tests.service.first_release import FILE, copied, unpack
from tests.service.support import BOTH, KINDS, TIMEOUT

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
    """The database of a service of version 0.1.0, with jobs in every state."""
    url = f"sqlite:///{unpack(tmp_path) / FILE}"
    if request.param == "postgresql":
        url = request.getfixturevalue("postgres").database()
        copied(tmp_path, url)
    database = Database(url)
    yield database
    database.close()


ON_BOTH = pytest.mark.parametrize("old", KINDS, indirect=True)
ON_SQLITE = pytest.mark.parametrize("old", ["sqlite"], indirect=True)


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
    """The statement of each index with normalised blanks; its name if a table constraint makes it."""
    asked = "indexname, indexdef FROM pg_indexes WHERE schemaname = 'public'"
    if not database.shared:
        asked = "name, sql FROM sqlite_master WHERE type = 'index'"
    with database.reading() as session:
        found = session.execute(text(f"SELECT {asked}")).all()
    return {name if "pk" in name else " ".join((made or name).split()) for name, made in found}


def rows(database: Database, statement: str) -> list[tuple[Any, ...]]:
    with database.reading() as session:
        return [tuple(row) for row in session.execute(text(statement)).all()]


@ON_BOTH
def test_later_columns_are_filled_for_earlier_rows(old: Database) -> None:
    """Sums, places in the queue, and whose a label is: as if they had always been kept."""
    uses = dict(rows(old, "SELECT sha256, count(*) FROM asset_uses GROUP BY sha256"))
    with old.reading() as session:
        failures = session.scalars(select(METADATA.tables["jobs"].c.failure)).all()
    failed = Counter(failure["code"] for failure in failures if failure)
    upgrade(old)
    with old.reading() as session:
        jobs = session.scalars(select(JobRow)).all()
        assert totals.failed(session) == failed
        owners = {job.number: job.owner for job in jobs}
        labels = session.execute(select(LabelRow.job, LabelRow.owner)).all()
        assert labels
        assert all(owners[job] == owner for job, owner in labels)
        assert {asset.sha256: asset.renders for asset in session.scalars(select(AssetRow))} == uses
        waiting = [job.number for job in jobs if job.state is JobState.QUEUED and job.paused_at is None]
        assert sorted(fairness.positions(session, jobs)) == waiting
        assert set(session.scalars(select(RenderRow.final_prefix))) == {""}
        for job in jobs:
            if job.number in waiting:
                assert job.render is not None
                assert job.coarse_cpu_seconds == pytest.approx(fairness.coarse_cpu_seconds(job.render))
        private = select(RenderRow.spec_sha256, RequestRow.body).where(RenderRow.version.is_(None))
        private = private.join(JobRow, JobRow.id == RenderRow.id).join(
            RequestRow, RequestRow.job == JobRow.number
        )
        for digest, body in session.execute(private).all():
            assert digest == hashlib.sha256(zlib.decompress(body)).hexdigest()
    assert waiting
    idle = "SELECT number FROM renders WHERE idle_since = ({}) ORDER BY number"
    latest = "SELECT max(finished_at) FROM jobs WHERE render_number = renders.number"
    unpinned = "SELECT number FROM renders WHERE idle_since IS NOT NULL ORDER BY number"
    assert rows(old, idle.format(latest)) == rows(old, unpinned) != []


class Counting(Folder):
    """A folder that counts how often it is listed."""

    listed = 0

    def found(self, prefix: str = "") -> Iterator[Found]:
        Counting.listed += 1
        return super().found(prefix)


@ON_BOTH
def test_later_migration_keeps_rows_and_a_failed_one_all(old: Database, later: Path, tmp_path: Path) -> None:
    before = columns_of(old, "jobs")
    deaths = [row[0] for row in rows(old, "SELECT deaths FROM tiles")]
    with pytest.raises(ZeroDivisionError):
        upgrade(old, scripts(tmp_path / "failing", LATER + "    1 / 0\n"))
    assert columns_of(old, "jobs") == before
    assert "losses" not in columns_of(old, "tiles")
    for _ in range(2):
        upgrade(old, later)
        with old.reading() as session:
            courses = session.execute(text("SELECT owner, course FROM jobs")).all()
            losses = session.scalars(text("SELECT losses FROM tiles")).all()
        assert courses
        assert all(course == f"that of {owner}" for owner, course in courses)
        assert list(losses) == deaths


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_later_version_waits_for_the_end_of_an_earlier_one(
    kind: str, start: Start, later: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Two versions on one database: what the earlier one writes lacks what the later one relies on."""
    url = request.getfixturevalue("postgres").database() if kind == "postgresql" else None
    server = start(workers=1, database=url)
    database = Database(Settings(data=tmp_path, database=url).database_url)
    with pytest.raises(DatabaseVersionError, match="earlier version"):
        upgrade(database, later, wait_seconds=1.0)
    assert "course" not in columns_of(database, "jobs")
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(upgrade, database, later)
        server.stop()
        waiting.result(TIMEOUT)
    assert "course" in columns_of(database, "jobs")
    database.close()


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
