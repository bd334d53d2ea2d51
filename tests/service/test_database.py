"""The database: built by migrations, safe to share between threads."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import func, select, text
from sqlalchemy.exc import IntegrityError

from service.storage.database.connection import Database
from service.storage.database.migrations import SCRIPTS, upgrade
from service.storage.database.models import AssetRow, Base, TileRow
from tests.service.support import BOTH


def asset(number: int) -> AssetRow:
    moment = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    return AssetRow(
        sha256=f"{number:064x}",
        bytes=1,
        media_type="image/png",
        width=1,
        height=1,
        created_at=moment,
        used_at=moment,
    )


def test_migrations_have_the_names_of_their_files_in_their_order() -> None:
    """Where the last one has been run, a service looks no further."""
    revisions = [script.revision for script in ScriptDirectory(str(SCRIPTS)).walk_revisions()]
    files = [path.stem for path in SCRIPTS.glob("versions/*.py") if path.stem != "__init__"]
    assert revisions == sorted(files, reverse=True)
    assert all(name.startswith("tables_") for name in files)


@BOTH
def test_migrations_build_exactly_the_tables_of_the_models(database: Database) -> None:
    with database.engine.connect() as connection:
        # Alembic compares no order and no condition of an index: the next test does.
        options = {"compare_type": True, "include_object": lambda _, name, *__: name != "ix_jobs_queue"}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, Base.metadata) == []


@BOTH
def test_migrations_build_exactly_the_indices_of_the_models(
    database: Database, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    url = request.getfixturevalue("postgres").database() if database.shared else f"sqlite:///{tmp_path}/made"
    made = Database(url)
    for index in chain.from_iterable(table.indexes for table in Base.metadata.tables.values()):
        index.dialect_options["postgresql"]["where"] = index.dialect_options["sqlite"]["where"]
    Base.metadata.create_all(made.engine)
    expected, found = (_indices(one) for one in (made, database))
    made.close()
    assert {one for one in found if "alembic" not in one} == expected


def _indices(database: Database) -> set[str]:
    """What makes each index, whatever stands between the words; its name where a table makes it."""
    asked = "indexname, indexdef FROM pg_indexes WHERE schemaname = 'public'"
    if not database.shared:
        asked = "name, sql FROM sqlite_master WHERE type = 'index'"
    with database.reading() as session:
        found = session.execute(text(f"SELECT {asked}")).all()
    return {name if "pk" in name else " ".join((made or name).split()) for name, made in found}


@BOTH
def test_migrating_again_changes_nothing(database: Database) -> None:
    with database.writing() as session:
        session.add(asset(1))
    upgrade(database)
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(AssetRow)) == 1


@BOTH
def test_times_come_back_in_utc(database: Database) -> None:
    with database.writing() as session:
        session.add(asset(1))
    with database.reading() as session:
        assert session.scalars(select(AssetRow.created_at)).one() == datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


def test_sqlite_keeps_a_write_ahead_log_and_foreign_keys(database: Database) -> None:
    with database.reading() as session:
        assert session.scalar(text("PRAGMA journal_mode")) == "wal"
    with pytest.raises(IntegrityError, match="FOREIGN KEY"), database.writing() as session:
        session.add(TileRow(render=1, pass_index=0, tile=0, x0=0, y0=0, x1=1, y1=1))


@BOTH
def test_what_an_exception_leaves_is_undone(database: Database) -> None:
    def fail() -> None:
        with database.writing() as session:
            session.add(asset(1))
            session.flush()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with database.reading() as session:
        assert session.get(AssetRow, f"{1:064x}") is None


@BOTH
def test_writers_who_read_first_wait_for_each_other(database: Database) -> None:
    def count_up() -> None:
        for _ in range(25):
            with database.writing() as session:
                session.add(asset(session.scalar(select(func.count()).select_from(AssetRow)) or 0))

    threads = [threading.Thread(target=count_up) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(AssetRow)) == 100
