"""A place belongs to one database, and to one service or several that share it."""

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from sqlalchemy import select, text

from service.errors import StoreAwayError, StoreTakenError
from service.storage import ownership
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow
from service.storage.folder import place_of
from service.storage.objects import Objects
from tests.s3_server import BUCKET, S3Server
from tests.service.support import BOTH, TIMEOUT, pictured


@BOTH
def test_place_belongs_to_one_database(place: Objects, database: Database) -> None:
    for _ in range(2):
        ownership.check(database, place)
    with pytest.raises(StoreTakenError, match="database-id"):
        ownership.check(database, place.within("other"))


@pytest.mark.parametrize("name", ["jobs/ab/spec.json", "database-id"])
def test_place_of_another_database_is_refused(place: Objects, database: Database, name: str) -> None:
    place.begin("jobs/ab")
    place.put(name, b"{}")
    with pytest.raises(StoreTakenError, match="another database"):
        ownership.check(database, place)


def test_place_to_which_pictures_were_copied_is_taken(place: Objects, database: Database) -> None:
    with database.writing() as session:
        session.add(pictured("ab"))
    with pytest.raises(StoreTakenError, match="folders jobs and"):
        ownership.check(database, place)
    place.begin("jobs/ab")
    place.put("jobs/ab/image.npy", b"")
    ownership.check(database, place)
    assert place.find(ownership.MARK_FILE)


@BOTH
def test_place_claimed_before_a_crash_is_taken(place: Objects, database: Database) -> None:
    with database.writing() as session:
        session.scalars(select(LeaderRow)).one().folder = f"{ownership.CLAIMED}ab"
    for _ in range(2):
        ownership.check(database, place)
    assert place.get(ownership.MARK_FILE) == b"ab\n"
    with database.reading() as session:
        assert session.scalars(select(LeaderRow)).one().folder == "ab"


@pytest.mark.parametrize("database", ["postgresql"], indirect=True)
def test_servers_that_start_at_once_share_one_place(place: Objects, database: Database) -> None:
    parts = [place.within(name) for name in "ababab"]
    for part in parts:
        part.begin("")
    with ThreadPoolExecutor(len(parts)) as pool:
        checks = [pool.submit(ownership.check, database, part) for part in parts]
        refused = [type(check.exception()) for check in checks]
    assert {frozenset(refused[::2]), frozenset(refused[1::2])} == {
        frozenset({type(None)}),
        frozenset({StoreTakenError}),
    }


def test_folder_is_shared_by_servers_on_postgresql_only(tmp_path: Path) -> None:
    with ownership.held(tmp_path, shared=True):
        with ownership.held(tmp_path, shared=True):
            pass
        with pytest.raises(StoreTakenError), ownership.held(tmp_path, shared=False):
            pass


@pytest.mark.slow
@BOTH
def test_server_that_waits_for_its_bucket_locks_no_other(
    object_store: S3Server, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = place_of(f"s3://{BUCKET}/started-{database.shared}")
    reached, keep = threading.Event(), place.put

    def put(name: str, data: bytes, *, durable: bool) -> None:
        """Let the bucket stall when the place is about to be marked."""
        object_store.stall()
        reached.set()
        keep(name, data, durable=durable)

    with monkeypatch.context() as patch, ThreadPoolExecutor(1) as pool:
        patch.setattr(place, "put", put)
        starting = pool.submit(ownership.check, database, place)
        try:
            assert reached.wait(TIMEOUT)
            for _ in range(10):
                with database.writing() as session:
                    session.execute(text("UPDATE leader SET term = term + 1"))
            assert not starting.done()
            assert isinstance(starting.exception(), StoreAwayError)
        finally:
            object_store.resume()
    # The next start finds what this one has begun.
    for _ in range(2):
        ownership.check(database, place)
