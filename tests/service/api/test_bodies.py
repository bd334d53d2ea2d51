"""Bodies of requests: malformed, misspelt, too long, too slow, compressed, cut off."""

import contextlib
import copy
import gzip
import json
import random
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from schemas.api.jobs import JobRequest
from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.reading import read_document
from service.server import RunningServer
from service.settings import Settings
from tests.service.forking import running
from tests.service.sending import JSON, MARK, connected, mistakes, problem_of
from tests.service.support import finish, scene, submit

PATHS = ["/v1/jobs", "/v1/plans", "/v1/traces", "/v1/comparisons"]
NUMBERS = {"NaN": "NaN", "Infinity": "Infinity", "1e400": "1e400", "5,000 digits": "1" * 5000}
BODIES = {
    "empty": b"",
    "no JSON": MARK.encode(),
    "not an object": b"[1, 2]",
    "cut off": b'{"scene": {"version": 1',
    "invalid UTF-8": b'{"scene": "\xff\xfe"}',
    "lone surrogate": b'{"scene": {"version": 1, "name": "\\ud800"}}',
    "100,000 deep": b'{"scene": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    "same key twice": b'{"scene": 1, "scene": 2}',
    "NUL": b"\x00",
    **{
        f"width {name}": f'{{"scene": {{"camera": {{"width": {text}}}}}}}'.encode()
        for name, text in NUMBERS.items()
    },
}


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_malformed_body_is_refused_with_its_mistakes(api: httpx2.Client, body: bytes) -> None:
    for path in PATHS:
        assert problem_of(api.post(path, content=body, headers=JSON), 422)["errors"]


def test_misspelt_field_is_found_in_the_text_that_was_sent(api: httpx2.Client) -> None:
    document = scene()
    document["camera"]["widht"] = document["camera"].pop("width")
    text = json.dumps({"scene": document}, indent=1)
    answer = api.post("/v1/jobs", content=text.encode(), headers=JSON)
    found = {one["pointer"]: one for one in problem_of(answer, 422)["errors"]}["/scene/camera/widht"]
    assert text.splitlines()[found["line"] - 1].strip().startswith('"widht"')
    assert found["suggestion"] == "width"


def test_other_media_type_is_refused(api: httpx2.Client) -> None:
    problem_of(api.post("/v1/jobs", content=b"{}", headers={"Content-Type": "text/plain"}), 415)


def test_compressed_body_is_not_unpacked(api: httpx2.Client) -> None:
    bomb = gzip.compress(b" " * 10_000_000)
    for encoding in ("gzip", "br", "GZIP, gzip"):
        headers = JSON | {"Content-Encoding": encoding}
        problem_of(api.post("/v1/jobs", content=bomb, headers=headers), 415)
        problem_of(api.put(f"/v1/assets/{'0' * 64}", content=bomb, headers=headers), 415)


def mutated(source: random.Random) -> bytes:
    """A request in which a few values, names or bytes are exchanged for odd ones."""
    document: Any = {"scene": scene(), "labels": {"a": "b"}, "quality": {"mode": "fixed"}}
    odd = [0, -1, 0.5, 2**53 + 1, 1e308, 5e-324, "", "\ud800", "../etc/passwd", None, True, [], {}, [[0]]]
    for _ in range(source.randint(1, 4)):
        place: Any = document
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            if not keys:
                break
            key = source.choice(keys)
            if not isinstance(place[key], dict | list) or source.random() < 0.2:
                place[key] = copy.deepcopy(source.choice(odd))
                break
            place = place[key]
    text = bytearray(json.dumps(document).encode())
    for _ in range(source.choice([0, 0, 1, 20])):
        text[source.randrange(len(text))] = source.randrange(256)
    return bytes(text[: source.randrange(len(text))] if source.random() < 0.2 else text)


def test_mutated_body_is_read_or_refused() -> None:
    source = random.Random(1)
    for _ in range(200):
        with contextlib.suppress(SceneError):
            read_document(mutated(source), JobRequest, limits=Limits(max_body_bytes=200_000))


@pytest.mark.slow
def test_mutated_bodies_never_break_the_service(api: httpx2.Client) -> None:
    source = random.Random(2026)
    for number in range(400):
        path = ["/v1/plans", "/v1/jobs", "/v1/traces", "/v1/previews"][number % 4]
        answer = api.post(path, content=mutated(source), headers=JSON)
        assert answer.status_code < 500, answer.text
    assert api.post("/v1/plans", json={"scene": scene()}).status_code == 200


@pytest.fixture(scope="module")
def hasty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A server that waits half a second for what clients send."""
    data = tmp_path_factory.mktemp("hasty")
    wanted = Settings(data=data, port=0, workers=1, log_level="error", client_timeout_seconds=0.5)
    with running(wanted) as started:
        yield started


def status_of(server: RunningServer, head: str, body: bytes = b"") -> int:
    """Send the beginning of a request that never ends, and return the status of the answer."""
    begun = f"POST /v1/plans HTTP/1.1\r\nHost: 127.0.0.1\r\n{head}\r\n\r\n".encode() + body
    with connected(server, begun) as connection:
        return int(connection.recv(65536).split(b" ")[1])


def test_body_that_is_too_long_is_refused_before_its_end(server: RunningServer) -> None:
    assert status_of(server, "Content-Length: 1000000000000") == 413
    chunk = b"10000\r\n" + b" " * 0x10000 + b"\r\n"
    assert status_of(server, "Transfer-Encoding: chunked", 20 * chunk) == 413


@pytest.mark.parametrize("length", ["Content-Length: 1000", "Transfer-Encoding: chunked"])
def test_body_that_does_not_come_is_given_up(hasty: RunningServer, length: str) -> None:
    assert status_of(hasty, length) == 408


def test_body_that_stops_at_its_last_byte_is_given_up(hasty: RunningServer) -> None:
    size = 8 << 20
    assert status_of(hasty, f"Content-Length: {size}", b" " * (size - 1)) == 408


def test_body_that_breaks_off_affects_no_other_request(server: RunningServer, client: httpx2.Client) -> None:
    connected(server, b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n{").close()
    finish(client, submit(client, scene(8, 8)))


def test_connection_with_half_a_body_is_closed_after_the_answer(hasty: RunningServer) -> None:
    begun = b"GET /version HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000\r\n\r\nx"
    with connected(hasty, begun) as connection, connection.makefile("rb") as received:
        assert received.read().startswith(b"HTTP/1.1 200")


def test_scene_without_its_wrapping_is_one_mistake(api: httpx2.Client) -> None:
    document = scene() | {"shapes": [{"type": "cube"}], "quality": {"mode": "fixed"}}
    for path in ("/v1/jobs", "/v1/plans", "/v1/quotes", "/v1/traces"):
        assert mistakes(api.post(path, json=document)) == [("", "bare_scene")]
