"""Reactions of a client to faulty servers: real sockets, answers written by hand."""

import json
import shutil
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from service.client import (
    BusyError,
    Client,
    ConflictError,
    JobCancelledError,
    JobExpiredError,
    NoImageError,
    NotAllowedError,
    NotFoundError,
    RequestInvalidError,
    ServerFaultError,
    TimedOutError,
    TLSError,
    UnexpectedAnswerError,
    UnreachableError,
    succeeded,
)
from service.client.access import access

Answer = tuple[int, dict[str, str], bytes]
Serve = Callable[[list[Answer | None]], "Server"]
PROBLEM = {"Content-Type": "application/problem+json"}
VERSION: Answer = (
    200,
    {"Content-Type": "application/json"},
    b'{"name": "penumbra", "version": "9", "new": [1]}',
)
SCENE: dict[str, Any] = {"version": 1}
LINKS = dict.fromkeys(("self", "cancel", "tiles", "events", "plan", "image_png", "image_npy"), "/")
JOB: Answer = (
    202,
    {"Content-Type": "application/json"},
    json.dumps(
        {
            "id": "j",
            "state": "queued",
            "width": 2,
            "height": 1,
            "progress": {"done": 0, "total": 1, "share": 0, "news": True},
            "last_seq": 0,
            "created_at": "2026-01-01T00:00:00Z",
            "cost": {"predicted_cpu_seconds": 1, "cpu_seconds": 0, "rays": {}},
            "quality": {},
            "links": LINKS | {"newest": "/"},
            "unheard_of": [1],
        }
    ).encode(),
)


def _problem(status: int, **members: Any) -> bytes:
    return json.dumps({"title": "Wrong", "status": status, "detail": "It is so.", **members}).encode()


class Server(ThreadingHTTPServer):
    """Gives its answers one after the other, the last again and again; None breaks the connection."""

    def __init__(self, answers: list[Answer | None]) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.answers = answers
        self.seen: list[str] = []
        self.paths: list[str] = []
        self.headers: list[Message] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def _answer(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.seen.append(self.command)
        self.server.paths.append(self.path)
        self.server.headers.append(self.headers)
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
    (401, NotAllowedError),
    (403, NotAllowedError),
    (404, NotFoundError),
    (410, NotFoundError),
    (409, ConflictError),
    (429, BusyError),
    (503, BusyError),
    (507, BusyError),
    (500, ServerFaultError),
]


@pytest.mark.parametrize(("status", "kind"), KINDS)
def test_exception_of_each_status(serve: Serve, status: int, kind: type[Exception]) -> None:
    server = serve([(status, PROBLEM, _problem(status, unknown="member"))])
    with Client(server.url, retry_seconds=0.5) as client, pytest.raises(kind, match="It is so"):
        client.get("x")
    assert server.seen == ["GET"]


def test_message_lists_every_problem(serve: Serve) -> None:
    errors = [
        {"pointer": "/quality", "detail": "Not so.", "code": "a", "suggestion": "thus"},
        {"pointer": "/limit", "detail": "Nor so.", "code": "b", "line": 3, "column": 4},
    ]
    server = serve([(422, PROBLEM, _problem(422, errors=errors, more=5))])
    with Client(server.url) as client, pytest.raises(RequestInvalidError) as caught:
        client.get("x")
    for part in ("/quality", "Not so.", "thus", "/limit: Nor so.", "5 more"):
        assert part in str(caught.value)


def test_busy_server_is_retried_after_its_time(serve: Serve) -> None:
    server = serve([(503, PROBLEM | {"Retry-After": "0"}, _problem(503)), VERSION])
    with Client(server.url) as client:
        assert client.version().version == "9"
    assert server.seen == ["GET", "GET"]


@pytest.mark.parametrize(("state", "kind"), [("cancelled", JobCancelledError), ("expired", JobExpiredError)])
def test_gone_picture_exception(serve: Serve, state: str, kind: type[NoImageError]) -> None:
    status, headers, content = JOB
    server = serve([(status, headers, content.replace(b"queued", state.encode()))])
    with Client(server.url) as client:
        job = client.get("j")
    with pytest.raises(kind, match="Job j") as caught:
        succeeded(job)
    assert caught.value.job_id == "j"


def test_key_is_sent_and_never_shown(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    server = serve([VERSION])
    monkeypatch.setenv("PENUMBRA_KEY", "from-environment")
    monkeypatch.setenv("PENUMBRA_SERVER", server.url)
    with Client(key="given") as given, Client() as found:
        given.version()
        found.version()
        assert "given" not in repr(given) + repr(access(key="given"))
    monkeypatch.delenv("PENUMBRA_KEY")
    with Client() as without:
        without.version()
    sent = [headers["Authorization"] for headers in server.headers]
    assert sent == ["Bearer given", "Bearer from-environment", None]


def test_wait_beyond_the_timeout_is_not_begun(serve: Serve) -> None:
    server = serve([(429, PROBLEM | {"Retry-After": "3600"}, _problem(429))])
    with Client(server.url) as client, pytest.raises(BusyError) as caught:
        client.version()
    assert caught.value.retry_after == 3600
    assert server.seen == ["GET"]


def test_safe_calls_are_retried(serve: Serve) -> None:
    server = serve([None, None, VERSION])
    with Client(server.url) as client:
        assert client.version().version == "9"
    assert server.seen == ["GET"] * 3


def test_unsafe_calls_are_sent_once(serve: Serve) -> None:
    server = serve([None])
    with Client(server.url) as client, pytest.raises(UnreachableError):
        client.delete("x")
    assert server.seen == ["DELETE"]


def test_submission_is_retried_under_one_key(serve: Serve) -> None:
    server = serve([None, JOB, None, JOB])
    with Client(server.url) as client:
        assert [client.submit(SCENE).id, client.submit(SCENE).id] == ["j", "j"]
        client.submit(SCENE, idempotency_key="mine")
    first, again, second, second_again, own = [headers["Idempotency-Key"] for headers in server.headers]
    assert (first, second, own) == (again, second_again, "mine")
    assert first != second


def test_other_server_is_named(serve: Serve) -> None:
    page: Answer = (502, {"Content-Type": "text/html"}, b"<h1>Bad gateway</h1>")
    for answer in (page, (200, {}, b"{}"), (200, {}, b"<html>"), (500, PROBLEM, b"{}")):
        server = serve([answer])
        with Client(server.url) as client, pytest.raises(UnexpectedAnswerError):
            client.get("x")
        assert server.seen == ["GET"]


def test_silence_is_a_timeout_of_the_job() -> None:
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as deaf:
        url = f"http://127.0.0.1:{deaf.server_address[1]}"
        with Client(url, timeout=0.2) as client, pytest.raises(TimedOutError, match="job abc") as caught:
            client.get("abc")
    assert caught.value.job_id == "abc"


@pytest.mark.skipif(not shutil.which("openssl"), reason="openssl is not installed")
def test_wrong_certificate_is_named_at_once(serve: Serve, tmp_path: Path) -> None:
    plain, server = serve([VERSION]), serve([VERSION])
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=other.example"]
    subprocess.run([*made, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    server.socket = context.wrap_socket(server.socket, server_side=True)
    for other, cause in ((server, "self-signed certificate"), (plain, "http://")):
        url = other.url.replace("http:", "https:")
        # Repeated for a minute, it would not end before the test's time is up.
        with Client(url, retry_seconds=60) as client, pytest.raises(TLSError, match=cause):
            client.version()


def test_missing_server() -> None:
    with pytest.raises(UnreachableError) as caught, Client("http://127.0.0.1:1", retry_seconds=0.0) as client:
        client.version()
    assert str(caught.value) == (
        "There is no server at http://127.0.0.1:1 (Connection refused). "
        "Start one with 'penumbra serve', or set PENUMBRA_SERVER to the address of another."
    )
