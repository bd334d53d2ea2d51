"""Malformed bodies and parameters: all answers have one form, and never echo the input."""

from __future__ import annotations

import gzip
import hashlib
import json
import socket
import time
from typing import Any

import httpx2
import pytest

from service.server import RunningServer
from tests.service.support import finish, scene, submit

MARK = "e7a1-not-to-be-repeated"
JSON = {"Content-Type": "application/json"}

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


def problem_of(answer: httpx2.Response, status: int) -> dict[str, Any]:
    """The problem document of an answer, after what holds for all of them."""
    assert answer.status_code == status, answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert document["status"] == status
    assert "Traceback" not in answer.text
    assert MARK not in answer.text
    return document


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans", "/v1/traces", "/v1/comparisons"])
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_a_bad_body_gets_a_list_of_what_is_wrong(client: httpx2.Client, path: str, body: bytes) -> None:
    answer = client.post(path, content=body, headers=JSON)
    assert problem_of(answer, 422)["errors"]


def test_problems_point_into_the_users_own_text(client: httpx2.Client) -> None:
    document = scene()
    document["camera"]["widht"] = document["camera"].pop("width")
    text = json.dumps({"scene": document}, indent=1)
    answer = client.post("/v1/jobs", content=text.encode(), headers=JSON)
    found = {one["pointer"]: one for one in problem_of(answer, 422)["errors"]}["/scene/camera/widht"]
    assert text.splitlines()[found["line"] - 1].strip().startswith('"widht"')
    assert found["suggestion"] == "width"


def test_many_problems_are_counted_and_fifty_listed(client: httpx2.Client) -> None:
    document = scene() | {
        "shapes": [{"type": "ellipsoid", "center": MARK, "radius": 1, "material": "ball"}] * 70
    }
    found = problem_of(client.post("/v1/jobs", json={"scene": document}), 422)
    assert (len(found["errors"]), found["more"]) == (50, 20)


def test_a_wrong_media_type_is_refused(client: httpx2.Client) -> None:
    problem_of(client.post("/v1/jobs", content=b"{}", headers={"Content-Type": "text/plain"}), 415)


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans", "/v1/traces"])
def test_a_body_that_says_it_is_too_long_is_refused_unread(server: RunningServer, path: str) -> None:
    status = raw(
        server, f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000000\r\n\r\n".encode()
    )
    assert status == 413


def test_a_body_that_turns_out_too_long_is_refused_before_its_end(server: RunningServer) -> None:
    chunk = b"10000\r\n" + b" " * 0x10000 + b"\r\n"
    head = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
    assert raw(server, head + 20 * chunk) == 413


def test_a_body_that_breaks_off_affects_no_other_request(
    server: RunningServer, client: httpx2.Client
) -> None:
    with socket.create_connection((client.base_url.host, client.base_url.port)) as connection:
        connection.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n{")
    time.sleep(0.1)
    finish(client, submit(client, scene(8, 8)))


def raw(server: RunningServer, data: bytes) -> int:
    """Send bytes and return the status of what comes back, without ever ending the request."""
    host, port = server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=20) as connection:
        connection.sendall(data)
        return int(connection.recv(65536).split(b" ")[1])


@pytest.mark.parametrize("method", ["GET", "DELETE"])
@pytest.mark.parametrize("job", ["0123456789abcdef", "%00", "..%2F..%2Fetc", "%F0%9F%92%A9", "x" * 64])
def test_an_unknown_job_is_not_found(client: httpx2.Client, method: str, job: str) -> None:
    problem_of(client.request(method, f"/v1/jobs/{job}"), 404)


def test_unknown_paths_and_methods_have_the_same_form(client: httpx2.Client) -> None:
    problem_of(client.get("/v2/jobs"), 404)
    answer = client.put("/v1/jobs", json={})
    problem_of(answer, 405)
    assert answer.headers["Allow"]


@pytest.mark.parametrize(
    "query",
    [
        {"after": "-1"},
        {"after": MARK},
        {"wait": "nan"},
        {"wait": "inf"},
        {"encoding": MARK},
        {"after": 2**40},
    ],
)
def test_parameters_are_checked(client: httpx2.Client, query: dict[str, str]) -> None:
    job = submit(client, scene(8, 8))
    found = problem_of(client.get(f"/v1/jobs/{job}/tiles", params=query), 422)
    assert next(iter(query)) in found["detail"]


@pytest.mark.parametrize("cursor", ["0", "abc", "-3", "9" * 30])
def test_a_cursor_is_checked(client: httpx2.Client, cursor: str) -> None:
    problem_of(client.get("/v1/jobs", params={"cursor": cursor}), 422)


LIMITS: dict[str, tuple[dict[str, Any], str]] = {
    "pixels": (scene(2000, 2000), "/scene/camera"),
    "samples": (scene(samples=2048, pattern="random"), "/scene/sampling/antialiasing/samples"),
    "shapes": (scene() | {"shapes": scene()["shapes"] * 60}, "/scene/shapes"),
    "cost": (scene(1000, 900, samples=1024, light_samples=1024), "/scene"),
}


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans"])
@pytest.mark.parametrize(("document", "pointer"), LIMITS.values(), ids=LIMITS)
def test_what_asks_too_much_is_refused_before_any_work(
    client: httpx2.Client, path: str, document: dict[str, Any], pointer: str
) -> None:
    newest = client.get("/v1/jobs", params={"limit": 1}).json()["jobs"]
    found = problem_of(client.post(path, json={"scene": document}), 422)["errors"]
    assert found[0]["pointer"].startswith(pointer)
    listed = client.get("/v1/jobs", params={"limit": 1}).json()["jobs"]
    assert [job["id"] for job in listed] == [job["id"] for job in newest]


def test_a_quality_cannot_ask_for_more_than_a_scene(client: httpx2.Client) -> None:
    quality = {"mode": "fixed", "antialiasing": {"pattern": "random", "samples": 2048}}
    found = problem_of(client.post("/v1/jobs", json={"scene": scene(), "quality": quality}), 422)["errors"]
    assert found[0]["pointer"].startswith("/quality/antialiasing")


@pytest.mark.parametrize("encoding", ["gzip", "br", "GZIP, gzip"])
def test_a_compressed_body_is_not_unpacked(client: httpx2.Client, encoding: str) -> None:
    bomb = gzip.compress(b" " * 10_000_000)
    headers = JSON | {"Content-Encoding": encoding}
    problem_of(client.post("/v1/jobs", content=bomb, headers=headers), 415)
    name = hashlib.sha256(bomb).hexdigest()
    problem_of(client.put(f"/v1/assets/{name}", content=bomb, headers=headers), 415)
