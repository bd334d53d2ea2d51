"""Names that a service answers to, headers for browsers, and clients that hold connections."""

from __future__ import annotations

import os
import pty
import socket
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path

import httpx2
import pytest

from service.server import RunningServer, running
from service.settings import Settings
from service.storage.ownership import held
from tests.service.support import TIMEOUT, scene
from tests.service.test_bad_requests import problem_of

EVIL = "rebound.example"
POLICY = "Content-Security-Policy"


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """Behind a proxy that passes on one name, with short timeouts."""
    settings = Settings(
        data=tmp_path_factory.mktemp("strict"),
        port=0,
        workers=1,
        log_level="error",
        behind_proxy=True,
        proxy_role="admin",
        hosts="127.0.0.1 render.example",
        client_timeout_seconds=0.5,
    )
    with running(settings) as server:
        yield server


@pytest.mark.parametrize("host", [EVIL, f"{EVIL}:8000", "127.0.0.1.rebound.example", "[::1", "10.1.2.3", ""])
def test_a_name_that_leads_here_from_elsewhere_is_refused(client: httpx2.Client, host: str) -> None:
    """The page of another site whose name was made to lead to loopback: all is of one origin then."""
    headers = {"Host": host, "Origin": f"http://{host}", "Sec-Fetch-Site": "same-origin"}
    for method, path in (
        ("GET", "/v1/jobs"),
        ("POST", "/v1/jobs"),
        ("GET", "/metrics"),
        ("GET", "/v1/session"),
    ):
        answer = client.request(method, path, headers=headers)
        # A malformed origin is refused as one of another site, before the name is checked.
        assert (answer.status_code, answer.json()["code"]) in {(421, "unknown_host"), (403, "cross_site")}
        if method == "GET":
            problem_of(answer, 421)


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1", "127.0.0.1", "127.8.9.10:8000", "[::1]:8000"])
def test_names_of_loopback_are_answered(client: httpx2.Client, host: str) -> None:
    assert client.get("/v1/jobs", headers={"Host": host}).status_code == 200


def test_a_proxy_passes_on_the_names_that_are_set(strict: RunningServer) -> None:
    for host, status in (
        ("render.example", 200),
        ("Render.Example:443", 200),
        (EVIL, 421),
        ("localhost", 421),
    ):
        assert httpx2.get(f"{strict.url}/v1/jobs", headers={"Host": host}).status_code == status


@pytest.mark.parametrize(
    "path", ["/", "/web/main.js", "/livez", "/v1/jobs", "/v1/jobs/none", "/metrics", "/openapi.json", "/none"]
)
def test_every_answer_limits_what_browsers_may_do(client: httpx2.Client, path: str) -> None:
    headers = client.get(path).headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "frame-ancestors 'none'" in headers[POLICY]
    assert "default-src 'none'" in headers[POLICY]
    assert "script-src" not in headers[POLICY] or "script-src 'self';" in headers[POLICY]
    assert "Access-Control-Allow-Origin" not in headers


def test_no_cache_keeps_answers_for_other_users(client: httpx2.Client) -> None:
    job = client.post("/v1/jobs", json={"scene": scene(8, 8)}, headers={"Prefer": "wait=30"}).json()["id"]
    for path in ("", "/image.png", "/image.npy", "/tiles", "/events", "/request", "/convergence", "/nothing"):
        rule = client.get(f"/v1/jobs/{job}{path}").headers["Cache-Control"]
        assert rule == "no-store" or rule.startswith("private, "), path
    etag = client.get(f"/v1/jobs/{job}/image.png").headers["ETag"]
    known = client.get(f"/v1/jobs/{job}/image.png", headers={"If-None-Match": etag})
    assert (known.status_code, known.headers["Cache-Control"]) == (304, "private, no-cache")


def connected(server: RunningServer) -> socket.socket:
    host, port = server.url.removeprefix("http://").split(":")
    return socket.create_connection((host, int(port)), timeout=TIMEOUT)


@pytest.mark.parametrize("sent", [b"", b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "])
def test_a_connection_without_a_request_is_given_up(strict: RunningServer, sent: bytes) -> None:
    with connected(strict) as connection:
        connection.sendall(sent)
        assert connection.recv(1000) == b""


@pytest.mark.slow
def test_a_connection_outlives_the_seconds_for_which_clients_keep_an_idle_one(server: RunningServer) -> None:
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


@pytest.mark.parametrize("length", ["Content-Length: 1000", "Transfer-Encoding: chunked"])
def test_a_body_that_does_not_come_is_given_up(strict: RunningServer, length: str) -> None:
    head = f"POST /v1/plans HTTP/1.1\r\nHost: 127.0.0.1\r\n{length}\r\n\r\n"
    with connected(strict) as connection:
        connection.sendall(head.encode())
        assert connection.recv(1000).startswith(b"HTTP/1.1 408")


def test_an_answer_before_the_end_of_a_body_does_not_keep_the_connection(strict: RunningServer) -> None:
    with connected(strict) as connection:
        connection.sendall(b"GET /version HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000\r\n\r\nx")
        received = b""
        while part := connection.recv(1000):
            received += part
        assert received.startswith(b"HTTP/1.1 200")


def test_a_data_folder_is_closed_to_other_users_of_the_machine(tmp_path: Path) -> None:
    with held(tmp_path / "new", shared=False):
        assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o700


def on_a_terminal(statements: str) -> str:
    """What a terminal is shown of the logs of some statements."""
    program = f"import structlog; from service import logs; logs.configure('info')\n{statements}"
    ours, theirs = pty.openpty()
    subprocess.run([sys.executable, "-c", program], stderr=theirs, check=True, timeout=TIMEOUT)
    os.close(theirs)
    shown = os.read(ours, 10_000).decode()
    os.close(ours)
    return shown


def test_text_from_outside_neither_begins_lines_of_the_log_nor_steers_a_terminal() -> None:
    """On a terminal; elsewhere a line is a JSON object, which has no control characters."""
    shown = on_a_terminal(r"structlog.get_logger().info('request', path='/a\nforged\x1b[2J\x9b')")
    assert shown.count("\n") == 1
    assert r"/a\nforged\x1b[2J\x9b" in shown


FAILURE = """
def ask(key):
    1 / 0
try:
    ask("secret" * 7)
except ZeroDivisionError:
    structlog.get_logger().exception("failed")
"""


def test_a_traceback_on_a_terminal_does_not_show_values() -> None:
    shown = on_a_terminal(FAILURE)
    assert "ZeroDivisionError" in shown
    assert "secretsecret" not in shown
