"""The database: built by migrations, shared by threads, and given up when it does not answer."""

import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from sqlalchemy import func, insert, select, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import IntegrityError, OperationalError

from service.errors import DatabaseUrlError
from service.storage.database import connection
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import AssetRow, Base
from tests.postgres_server import PostgresServer
from tests.service.between import Between
from tests.service.support import BOTH

MOMENT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


def asset(number: int) -> AssetRow:
    return AssetRow(
        sha256=f"{number:064x}",
        bytes=1,
        media_type="image/png",
        width=1,
        height=1,
        created_at=MOMENT,
        used_at=MOMENT,
    )


@BOTH
def test_rows_and_times_stay_when_it_is_migrated_again(database: Database) -> None:
    with database.writing() as session:
        session.add(asset(1))
    upgrade(database)
    with database.reading() as session:
        assert session.scalars(select(AssetRow.created_at)).one() == MOMENT


@BOTH
def test_exception_undoes_a_transaction(database: Database) -> None:
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
def test_writers_wait_for_each_other(database: Database) -> None:
    def count_up() -> None:
        for _ in range(10):
            with database.writing() as session:
                session.add(asset(session.scalar(select(func.count()).select_from(AssetRow)) or 0))

    threads = [threading.Thread(target=count_up) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(AssetRow)) == 40


@pytest.mark.parametrize(
    ("url", "cure"),
    [
        ("mysql://localhost/penumbra", "postgresql://user@host/name"),
        ("postgresql+psycopg2://localhost/penumbra", "postgresql://user@host/name"),
        ("penumbra.sqlite", "sqlite:///file"),
    ],
)
def test_address_that_cannot_be_used_is_refused(url: str, cure: str) -> None:
    with pytest.raises(DatabaseUrlError, match=cure):
        Database(url)


@pytest.fixture
def between(postgres: PostgresServer) -> Iterator[Between]:
    started = Between(str(postgres.folder / ".s.PGSQL.5432"))
    yield started
    started.close()


@pytest.mark.slow
def test_silent_database_is_given_up(
    postgres: PostgresServer, between: Between, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "ANSWER_SECONDS", 0.5)
    name = make_url(postgres.database()).database
    database = Database(f"postgresql+psycopg://postgres@127.0.0.1:{between.port}/{name}?connect_timeout=2")

    def ask() -> int:
        with database.reading() as session:
            return session.connection().exec_driver_sql("SELECT 1").scalar_one()

    assert ask() == 1
    between.swallow()
    try:
        with pytest.raises(OperationalError):
            ask()
    finally:
        between.pass_on()
    assert ask() == 1
    database.close()


def test_log_of_sqlite_gives_the_disk_back(database: Database, tmp_path: Path) -> None:
    log = tmp_path / "test.sqlite-wal"

    def write(count: int) -> None:
        for _ in range(count):
            with database.writing() as session:
                session.execute(text("CREATE TABLE IF NOT EXISTS filler (content BLOB)"))
                session.execute(text("INSERT INTO filler VALUES (randomblob(1000000))"))

    # Whoever reads keeps all that is written meanwhile in the log.
    with database.reading() as session:
        session.execute(select(func.count()).select_from(AssetRow)).all()
        write(12)
        assert log.stat().st_size > 12_000_000
    write(2)
    assert log.stat().st_size < 6_000_000


@BOTH
def test_error_of_a_pipeline_is_raised_as_any_other(database: Database) -> None:
    totals = Base.metadata.tables["totals"]

    def enter_twice() -> None:
        with database.writing() as session, database.pipelined(session):
            for _ in range(2):
                session.execute(insert(totals), {"name": "twice", "amount": 1})

    with pytest.raises(IntegrityError):
        enter_twice()
    with database.writing() as session:
        assert session.scalar(select(func.count()).select_from(totals)) == 0
