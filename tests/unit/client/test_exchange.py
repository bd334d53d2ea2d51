"""What a client makes of servers that behave badly: real sockets, answers made by hand."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from service.client import (
    BusyError,
    Client,
    ConflictError,
    NotFoundError,
    RequestInvalidError,
    ServerFaultError,
    TimedOutError,
    UnexpectedAnswerError,
    UnreachableError,
)

Answer = tuple[int, dict[str, str], bytes]
Serve = Callable[[list[Answer | None]], "Server"]
PROBLEM = {"Content-Type": "application/problem+json"}
VERSION: Answer = (
    200,
    {"Content-Type": "application/json"},
    b'{"name": "penumbra", "version": "9", "new": [1]}',
)
SCENE: dict[str, Any] = {"version": 1}


def _problem(status: int, **members: Any) -> bytes:
    return json.dumps({"title": "Wrong", "status": status, "detail": "It is so.", **members}).encode()


class Server(ThreadingHTTPServer):
    """Gives its answers one after the other, the last again and again; None breaks the connection."""

    def __init__(self, answers: list[Answer | None]) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.answers = answers
        self.seen: list[str] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def _answer(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.seen.append(self.command)
        answers = self.server.answers
        answer = answers.pop(0) if len(answers) > 1 else answers[0]
        self.close_connection = True
        if answer is None:
            return
        status, headers, content = answer
        self.send_response(status)
        for name, value in (headers | {"Content-Length": str(len(content))}).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST = do_DELETE = _answer  # noqa: N815 - the names that http.server looks for

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture
def serve() -> Iterator[Serve]:
    started: list[Server] = []

    def start(answers: list[Answer | None]) -> Server:
        server = Server(answers)
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        started.append(server)
        return server

    yield start
    for server in started:
        server.shutdown()
        server.server_close()


KINDS = [
    (422, RequestInvalidError),
    (400, RequestInvalidError),
    (404, NotFoundError),
    (410, NotFoundError),
    (409, ConflictError),
    (429, BusyError),
    (503, BusyError),
    (507, BusyError),
    (500, ServerFaultError),
]


@pytest.mark.parametrize(("status", "kind"), KINDS)
def test_a_problem_document_becomes_the_exception_of_its_status(
    serve: Serve, status: int, kind: type[Exception]
) -> None:
    server = serve([(status, PROBLEM, _problem(status, unknown="member"))])
    with Client(server.url, patience=0.5) as client, pytest.raises(kind, match="It is so"):
        client.get("x")
    assert server.seen == ["GET"]


def test_the_message_has_place_and_sentence_of_every_problem(serve: Serve) -> None:
    errors = [
        {"pointer": "/quality", "detail": "Not so.", "code": "a", "suggestion": "thus"},
        {"pointer": "/limit", "detail": "Nor so.", "code": "b", "line": 3, "column": 4},
    ]
    server = serve([(422, PROBLEM, _problem(422, errors=errors, more=5))])
    with Client(server.url) as client, pytest.raises(RequestInvalidError) as caught:
        client.get("x")
    for part in ("/quality", "Not so.", "thus", "/limit (line 3, column 4): Nor so.", "5 more"):
        assert part in str(caught.value)


def test_what_is_busy_is_asked_again_after_the_time_it_names(serve: Serve) -> None:
    server = serve([(503, PROBLEM | {"Retry-After": "0"}, _problem(503)), VERSION])
    with Client(server.url) as client:
        assert client.version().version == "9"
    assert server.seen == ["GET", "GET"]


def test_a_longer_wait_than_the_clients_patience_is_not_begun(serve: Serve) -> None:
    server = serve([(429, PROBLEM | {"Retry-After": "3600"}, _problem(429))])
    with Client(server.url) as client, pytest.raises(BusyError) as caught:
        client.version()
    assert caught.value.retry_after == 3600
    assert server.seen == ["GET"]


def test_a_broken_connection_is_tried_again_where_that_is_safe(serve: Serve) -> None:
    server = serve([None, None, VERSION])
    with Client(server.url) as client:
        assert client.version().version == "9"
    assert server.seen == ["GET"] * 3


@pytest.mark.parametrize(
    "act", [lambda c: c.submit(SCENE), lambda c: c.delete("x")], ids=["submit", "delete"]
)
def test_what_may_not_be_done_twice_is_sent_once(serve: Serve, act: Callable[[Client], object]) -> None:
    server = serve([None])
    with Client(server.url) as client, pytest.raises(UnreachableError):
        act(client)
    assert len(server.seen) == 1


def test_whoever_is_not_a_service_of_this_kind_is_told_apart(serve: Serve) -> None:
    page: Answer = (502, {"Content-Type": "text/html"}, b"<h1>Bad gateway</h1>")
    for answer in (page, (200, {}, b"{}"), (200, {}, b"<html>"), (500, PROBLEM, b"{}")):
        server = serve([answer])
        with Client(server.url) as client, pytest.raises(UnexpectedAnswerError):
            client.get("x")
        assert server.seen == ["GET"]


def test_silence_becomes_a_time_out_that_names_the_job() -> None:
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as deaf:
        url = f"http://127.0.0.1:{deaf.server_address[1]}"
        with Client(url, timeout=0.2) as client, pytest.raises(TimedOutError, match="job abc") as caught:
            client.get("abc")
    assert caught.value.job_id == "abc"


@pytest.mark.parametrize("address", ["http://127.0.0.1:1", "nonsense", "ftp://x", "http://"])
def test_where_there_is_no_server_the_address_is_told(address: str) -> None:
    with pytest.raises(UnreachableError, match=address), Client(address, patience=0.0) as client:
        client.version()


def test_an_id_cannot_lead_to_another_place(serve: Serve) -> None:
    server = serve([(404, PROBLEM, _problem(404))])
    with Client(server.url) as client, pytest.raises(NotFoundError):
        client.delete("../../livez?x=#")
    assert server.seen == ["DELETE"]
