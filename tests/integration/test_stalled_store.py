"""A bucket that takes requests and answers none: nobody waits for it who does not need it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count

import httpx2
import pytest

from service.errors import StoreAwayError
from service.server import RunningServer, running
from service.storage.bucket import CALL_SECONDS
from service.storage.folder import place_of
from service.storage.objects import Objects
from tests.integration.conftest import typical
from tests.integration.support import TIMEOUT, finish, scene, submit
from tests.s3_server import BUCKET, S3Server

# A call and what else there is to do, on a busy machine.
CALL_AND_MARGIN = CALL_SECONDS + 3.0
AT_ONCE = 1.0
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


def seconds_of(call: Callable[[], object]) -> float:
    begun = time.monotonic()
    call()
    return time.monotonic() - begun


CALLS: dict[str, Callable[[Objects], object]] = {
    "check": lambda place: place.check(),
    "find": lambda place: place.find("small"),
    "get": lambda place: place.get("small"),
    "many": lambda place: list(place.many(["small"] * 40)),
    "found": lambda place: list(place.found()),
    "put": lambda place: place.put("other", b"other"),
    "delete": lambda place: place.delete(["small"]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_a_call_is_given_up_after_about_five_seconds(object_store: S3Server, name: str) -> None:
    place = place_of(f"s3://{BUCKET}/calls-{next(NUMBERS)}")
    place.put("small", b"small")

    def call() -> None:
        with pytest.raises(StoreAwayError):
            CALLS[name](place)

    with stalled(object_store):
        assert seconds_of(call) < CALL_AND_MARGIN
    place.put("after", b"after")
    assert place.get("after") == b"after"


@pytest.mark.slow
def test_nothing_waits_for_the_bucket_under_the_write_lock(
    server: RunningServer, object_store: S3Server
) -> None:
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client, ThreadPoolExecutor(1) as pool:
        job = submit(client, scene(32, 32, samples=1))
        finish(client, job)
        with stalled(object_store):
            begun = time.monotonic()
            body = {"scene": scene(33, 33, samples=1)}
            sent = pool.submit(client.post, "/v1/jobs", json=body)
            longest = 0.0
            while not sent.done():
                pinned = client.put(f"/v1/jobs/{job}/pin")
                assert pinned.status_code == 200, pinned.text
                longest = max(longest, pinned.elapsed.total_seconds())
                time.sleep(0.05)
            answer = sent.result()
            waited = time.monotonic() - begun
            ready = client.get("/readyz")
        assert (answer.status_code, answer.json()["code"]) == (503, "store_away"), answer.text
        assert answer.headers["Retry-After"]
        # The request was under way, and the pins beside it.
        assert waited > AT_ONCE
        assert longest < AT_ONCE
        assert waited < CALL_AND_MARGIN
        assert (ready.status_code, "object store" in ready.json()["detail"]) == (503, True)
        assert ready.elapsed.total_seconds() < CALL_AND_MARGIN
        finish(client, submit(client, scene(33, 33, samples=1)))
