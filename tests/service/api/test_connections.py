"""Clients that hold as many connections as they can: probes are answered, and others find room."""

import json
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from http.client import HTTPConnection
from pathlib import Path

import httpx2
import pytest

from schemas.api.administration import Role
from schemas.limits import Limits
from service.server import RunningServer
from service.settings import Settings
from tests.service.forking import running
from tests.service.sending import client_of, connected, make_keys, problem_of, put
from tests.service.support import TIMEOUT, long_scene, scene, submit, until

MOST, MOST_OF_ADDRESS, MOST_STREAMS = 12, 4, 2
LONGEST_BODY = 1 << 16
# More than the server keeps for probes beyond its limits.
MANY = 60
ADDRESSES = [f"127.0.0.{number}" for number in range(1, 6)]
STRANGER = "127.0.0.9"
UNFINISHED = b"GET /version HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "


def settings(data: Path, **changes: object) -> Settings:
    limits = {"max_connections": MOST, "max_address_connections": MOST_OF_ADDRESS, "workers": 1}
    return Settings(**limits | {"data": data, "port": 0, "log_level": "error"} | changes)


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with running(settings(tmp_path_factory.mktemp("crowded"))) as started:
        yield started


@contextmanager
def held(server: RunningServer, addresses: list[str]) -> Iterator[None]:
    """Hold connections from each of these addresses, on which a request has begun and does not end."""
    with ExitStack() as stack:
        for address in addresses:
            for _ in range(MANY):
                stack.enter_context(connected(server, UNFINISHED, address))
        yield
    until(lambda: ask(server, "/version", addresses[0]).status_code == 200)


def ask(server: RunningServer, path: str, address: str) -> httpx2.Response:
    with client_of(server, address=address) as client:
        return client.get(path)


def test_connections_of_one_address_leave_room_for_others(crowded: RunningServer) -> None:
    with held(crowded, ADDRESSES[:1]):
        assert ask(crowded, "/version", STRANGER).status_code == 200
        assert ask(crowded, "/readyz", ADDRESSES[0]).status_code == 200
        refused = ask(crowded, "/version", ADDRESSES[0])
    assert problem_of(refused, 429)["code"] == "busy"
    assert (refused.headers["Retry-After"], refused.headers["Connection"]) == ("1", "close")
    assert refused.headers["X-Request-ID"]


def test_connections_of_all_leave_room_for_probes(crowded: RunningServer) -> None:
    with held(crowded, ADDRESSES):
        for path in ("/livez", "/readyz"):
            for address in (ADDRESSES[0], STRANGER):
                answer = ask(crowded, path, address)
                assert (answer.status_code, answer.json()) == (200, {"status": "ok"})
        refused = ask(crowded, "/version", STRANGER)
    assert problem_of(refused, 503)["code"] == "unavailable"
    assert refused.headers["Retry-After"] == "1"


@pytest.mark.slow
def test_connections_of_a_proxy_may_have_one_address(tmp_path: Path) -> None:
    with running(settings(tmp_path, trusted_proxies="127.0.0.1")) as server, ExitStack() as stack:
        clients = [stack.enter_context(client_of(server)) for _ in range(MOST - 1)]
        # Each keeps its connection.
        assert [client.get("/version").status_code for client in clients] == [200] * len(clients)


@pytest.mark.slow
def test_connection_outlives_the_pool_of_a_client(server: RunningServer) -> None:
    """A pool of httpx sends on a connection that was idle for less than 5 seconds."""
    connection = HTTPConnection(server.url.removeprefix("http://"), timeout=TIMEOUT)
    with closing(connection):
        connection.request("GET", "/livez")
        assert connection.getresponse().read()
        connection.sock.settimeout(6)
        # Nothing comes, and in particular not the end of the connection.
        with pytest.raises(TimeoutError):
            connection.sock.recv(1)
        connection.sock.settimeout(TIMEOUT)
        connection.request("GET", "/livez")
        assert connection.getresponse().status == 200


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningServer, dict[str, str]]]:
    """A server that requires keys, with little room, and its keys."""
    data = tmp_path_factory.mktemp("shared")
    made = make_keys(data, ann=Role.SUBMIT, bob=Role.SUBMIT)
    limits = {"max_connections": MANY, "max_address_connections": MANY, "max_user_streams": MOST_STREAMS}
    body = {"limits": Limits(max_body_bytes=LONGEST_BODY), "max_trace_rays": 1}
    with running(settings(data, **limits, **body, client_timeout_seconds=1)) as server:
        yield server, made


@pytest.fixture
def users(shared: tuple[RunningServer, dict[str, str]]) -> Iterator[tuple[httpx2.Client, httpx2.Client]]:
    server, made = shared
    with ExitStack() as stack:
        ann, bob = (stack.enter_context(client_of(server, key)) for key in made.values())
        yield ann, bob


def paused(client: httpx2.Client) -> str:
    """A job that does not end."""
    job = submit(client, long_scene())
    client.post(f"/v1/jobs/{job}/pause").raise_for_status()
    return job


def begun(
    shared: tuple[RunningServer, dict[str, str]], line: str, *more: str, address: str = "127.0.0.1"
) -> socket.socket:
    """A connection on which ann has sent the head of a request."""
    server, made = shared
    host, port = server.url.removeprefix("http://").split(":")
    lines = (f"{line} HTTP/1.1", "Host: 127.0.0.1", f"Authorization: Bearer {made['ann']}", *more, "", "")
    connection = socket.socket()
    # So little that nearly all of an answer stays with the server.
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.bind((address, 0))
    connection.connect((host, int(port)))
    connection.sendall("\r\n".join(lines).encode())
    return connection


def test_abandoned_waits_leave_room_for_others(
    shared: tuple[RunningServer, dict[str, str]], users: tuple[httpx2.Client, httpx2.Client]
) -> None:
    ann, _ = users
    waiting = f"/v1/jobs/{paused(ann)}/tiles?after=1000&wait="
    with ExitStack() as stack:

        def is_full() -> bool:
            stack.enter_context(begun(shared, f"GET {waiting}50"))
            return ann.get(f"{waiting}0.1").status_code == 429

        until(is_full)
    until(lambda: ann.get(f"{waiting}0.1").status_code == 200, seconds=15)


def test_unfinished_bodies_of_one_user_leave_room_for_others(
    shared: tuple[RunningServer, dict[str, str]], users: tuple[httpx2.Client, httpx2.Client]
) -> None:
    _, bob = users
    sent = [f"Content-Length: {LONGEST_BODY}", "Content-Type: application/json"]
    with ExitStack() as stack:
        for _ in range(20):
            connection = stack.enter_context(begun(shared, "POST /v1/plans", *sent))
            connection.sendall(b" " * (LONGEST_BODY - 1))
        assert bob.post("/v1/jobs", json={"scene": scene(33, 32)}).status_code == 202


@pytest.mark.slow
def test_answers_that_are_not_read_are_given_up(
    shared: tuple[RunningServer, dict[str, str]], users: tuple[httpx2.Client, httpx2.Client]
) -> None:
    ann, _ = users
    # More than buffers of the system take.
    mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + b"# a comment\n" * (1 << 20)
    asset = put(ann, mesh).json()["name"].removeprefix("sha256:")
    with ExitStack() as stack:

        def is_full() -> bool:
            for _ in range(MANY // 2):
                stack.enter_context(begun(shared, f"GET /v1/assets/{asset}", address=STRANGER))
            return ask(shared[0], "/version", STRANGER).status_code == 429

        until(is_full)
        assert ask(shared[0], "/version", ADDRESSES[1]).status_code == 200
        until(lambda: has_room(shared[0], STRANGER))


def has_room(server: RunningServer, address: str) -> bool:
    """Whether many connections of an address are answered at once; others that end leave it a few at most."""
    with ExitStack() as stack:
        clients = [stack.enter_context(client_of(server, address=address)) for _ in range(MANY // 4)]
        return all(client.get("/version").status_code == 200 for client in clients)


def exchanged(server: RunningServer, request: bytes, *, half_closed: bool = False) -> bytes:
    """Send bytes, perhaps close the side that sends, and return all that comes until the end."""
    with connected(server, request) as connection:
        if half_closed:
            connection.shutdown(socket.SHUT_WR)
        with connection.makefile("rb") as answer:
            return answer.read()


MALFORMED = {
    "no HTTP": (b"GARBAGE\r\n\r\n", 400),
    "TLS": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", 400),
    "no host": (b"GET /version HTTP/1.1\r\n\r\n", 400),
    "two lengths": (b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n", 400),
    "bad chunk": (b"POST /v1/plans HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", 400),
    "long head": (UNFINISHED + b"x" * 17_000, 431),
}


@pytest.mark.parametrize(("request_", "status"), MALFORMED.values(), ids=MALFORMED)
def test_malformed_request_is_a_problem_with_an_id(
    server: RunningServer, request_: bytes, status: int
) -> None:
    head, _, body = exchanged(server, request_).partition(b"\r\n\r\n")
    assert head.startswith(f"HTTP/1.1 {status} ".encode())
    assert re.search(rb"(?mi)^x-request-id: \w+\r$", head)
    assert b"content-type: application/problem+json" in head
    assert json.loads(body)["status"] == status


def test_target_in_absolute_form_is_that_of_its_host(server: RunningServer) -> None:
    def status_of(target: str, host: str) -> bytes:
        request = f"GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        return exchanged(server, request.encode()).split(b" ")[1]

    assert status_of("http://127.0.0.1/v1/jobs?limit=1", "other.example") == b"200"
    assert status_of("http://other.example/v1/jobs", "127.0.0.1") == b"421"


def test_client_that_only_reads_on_has_all_its_answers(server: RunningServer) -> None:
    request = b"GET /version HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    assert exchanged(server, 2 * request, half_closed=True).count(b"HTTP/1.1 200 OK") == 2
    assert exchanged(server, request[:-2], half_closed=True) == b""


def test_address_with_a_slash_at_its_end_leads_to_no_other_host(server: RunningServer) -> None:
    request = "GET {} HTTP/1.1\r\nHost: other.example\r\nConnection: close\r\n\r\n"
    redirected = exchanged(server, request.format("/v1/jobs/?limit=3").encode())
    assert b"\r\nlocation: /v1/jobs?limit=3\r\n" in redirected
    assert exchanged(server, request.format("//other.example/").encode()).startswith(b"HTTP/1.1 404 ")


@contextmanager
def watched(client: httpx2.Client, job: str) -> Iterator[int]:
    with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        yield answer.status_code


def test_streams_of_one_user_leave_room_for_others(users: tuple[httpx2.Client, httpx2.Client]) -> None:
    ann, bob = users
    mine, theirs = paused(ann), paused(bob)
    with ExitStack() as stack:
        for _ in range(MOST_STREAMS):
            assert stack.enter_context(watched(ann, mine)) == 200
        tiles = f"/v1/jobs/{mine}/tiles?after=1000"
        for path in (f"/v1/jobs/{mine}/events", f"{tiles}&wait=30"):
            assert problem_of(ann.get(path), 429)["code"] == "busy"
        # What does not wait is answered, and a job is accepted without the wait that it prefers.
        assert ann.get(tiles).status_code == 200
        taken = ann.post("/v1/jobs", json={"scene": scene(33, 31)}, headers={"Prefer": "wait=30"})
        assert (taken.status_code, taken.headers.get("Preference-Applied")) == (202, None)
        with watched(bob, theirs) as status:
            assert status == 200

    def has_place() -> bool:
        with watched(ann, mine) as status:
            return status == 200

    until(has_place)
