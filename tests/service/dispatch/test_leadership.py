"""One of several servers leads; the others learn what changes."""

import secrets
import threading
from collections.abc import Iterator
from datetime import timedelta
from itertools import takewhile

import pytest
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from service.dispatch.leadership import Leadership
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow
from tests.postgres_server import PostgresServer


@pytest.fixture
def two(postgres: PostgresServer) -> Iterator[tuple[Database, Database]]:
    """The same database, opened as two servers do."""
    first = postgres.emptied()
    second = Database(first.engine.url.render_as_string(hide_password=False))
    yield first, second
    first.close()
    second.close()


def term(database: Database, leadership: Leadership) -> int | None:
    with database.writing() as session:
        stood = leadership.stand(session)
        return stood.number if stood else None


@pytest.mark.parametrize("silent", [False, True], ids=["resigned", "silent"])
def test_leader_that_resigns_or_is_silent_is_followed(two: tuple[Database, Database], silent: bool) -> None:
    first, second = (Leadership(database) for database in two)
    begun = term(two[0], first)
    assert begun is not None
    assert [term(two[1], second), term(two[0], first)] == [None, begun]
    if silent:
        with two[0].writing() as session:
            session.scalars(select(LeaderRow)).one().expires_at -= timedelta(minutes=1)
    else:
        first.resign()
    assert [term(two[1], second), term(two[0], first)] == [begun + 1, None]
    second.resign()
    # Results of its first term are ignored.
    assert term(two[0], first) == begun + 2


@pytest.mark.slow
def test_server_that_stops_in_a_transaction_blocks_no_other(two: tuple[Database, Database]) -> None:
    def stop_in_the_middle() -> None:
        with two[0].writing() as session:
            leader = session.scalars(select(LeaderRow)).one()
            leader.term += 100
            session.flush()
            # Waits until the first one is cut off, because only one writes at a time.
            with two[1].writing() as other:
                found.append(other.scalars(select(LeaderRow.term)).one())

    found: list[int] = []
    with pytest.raises(SQLAlchemyError):
        stop_in_the_middle()
    with two[1].reading() as session:
        assert [session.scalars(select(LeaderRow.term)).one()] == found


@pytest.mark.parametrize("count", [1, 450])
def test_notices_reach_another_server(two: tuple[Database, Database], count: int) -> None:
    """Ids of 450 jobs are longer than a notice may be."""
    ids = {secrets.token_hex(16) for _ in range(count)}
    stopping = threading.Event()
    notices = two[0].notices(stopping)
    assert next(notices) == {}
    with two[1].writing() as session:
        two[1].notify_jobs(session, ids)
        two[1].notify(session, last=True)
    known = list(takewhile(lambda notice: "last" not in notice, notices))
    stopping.set()
    assert sorted(job for notice in known for job in notice["jobs"]) == sorted(ids)
