"""A bucket that takes requests and does not answer: only what needs it waits, and not for long."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import timedelta
from itertools import count

import httpx2
import pytest
from sqlalchemy import text

from service.errors import StoreAwayError
from service.server import RunningServer, running
from service.storage import ownership
from service.storage.bucket import CALL_SECONDS
from service.storage.database.connection import Database
from service.storage.folder import place_of
from service.storage.objects import Objects
from tests.s3_server import BUCKET, S3Server
from tests.service.conftest import typical
from tests.service.support import BOTH, TIMEOUT, finish, scene, submit

# Far more than a call may take, far less than the 30 seconds after which the bucket's library gives up.
GIVEN_UP_SECONDS = 3 * CALL_SECONDS
NUMBERS = count()


@pytest.fixture(scope="module")
def server(object_store: S3Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    changes = {"store": f"s3://{BUCKET}/stalled", "workers": 1}
    with running(typical(tmp_path_factory.mktemp("stalled"), **changes)) as started:
        yield started


@contextmanager
def stalled(object_store: S3Server) -> Iterator[None]:
    object_store.stall()
    try:
        yield
    finally:
        object_store.resume()


CALLS: dict[str, Callable[[Objects], object]] = {
    "check": lambda place: place.check(),
    "find": lambda place: place.find("small"),
    "get": lambda place: place.get("small"),
    "many": lambda place: list(place.many(["small"] * 40)),
    "found": lambda place: list(place.found()),
    "put": lambda place: place.put("other", b"other"),
    "delete": lambda place: place.delete(["small"]),
}


def test_every_call_is_given_up(object_store: S3Server) -> None:
    place = place_of(f"s3://{BUCKET}/calls-{next(NUMBERS)}")
    place.put("small", b"small")
    with ThreadPoolExecutor(len(CALLS)) as pool, stalled(object_store):
        calls = {name: pool.submit(call, place) for name, call in CALLS.items()}
        errors = {name: call.exception(GIVEN_UP_SECONDS) for name, call in calls.items()}
    assert {name: type(error) for name, error in errors.items()} == dict.fromkeys(CALLS, StoreAwayError)
    place.put("after", b"after")
    assert place.get("after") == b"after"


@pytest.mark.slow
@BOTH
def test_a_server_that_waits_for_its_bucket_as_it_starts_keeps_no_other_from_writing(
    object_store: S3Server, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = place_of(f"s3://{BUCKET}/started-{next(NUMBERS)}")
    reached, keep = threading.Event(), place.put

    def put(name: str, data: bytes) -> None:
        """Let the bucket stall when the place is about to be marked."""
        object_store.stall()
        reached.set()
        keep(name, data)

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


@pytest.mark.slow
def test_a_request_that_does_not_need_the_bucket_does_not_wait_for_it(
    server: RunningServer, object_store: S3Server
) -> None:
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client, ThreadPoolExecutor(1) as pool:
        job = submit(client, scene(32, 32, samples=1))
        finish(client, job)
        with stalled(object_store):
            sent = pool.submit(client.post, "/v1/jobs", json={"scene": scene(33, 33, samples=1)})
            pins = []
            while not sent.done():
                pins.append(client.put(f"/v1/jobs/{job}/pin"))
            answer, ready = sent.result(), client.get("/readyz")
        assert (answer.status_code, answer.json()["code"]) == (503, "store_away"), answer.text
        assert answer.headers["Retry-After"]
        assert {pin.status_code for pin in pins} == {200}
        # The last of them were sent while the other request waited, and none has waited as it did.
        assert max(pin.elapsed for pin in pins) < timedelta(seconds=CALL_SECONDS / 2)
        assert (ready.status_code, "object store" in ready.json()["detail"]) == (503, True)
        finish(client, submit(client, scene(33, 33, samples=1)))
