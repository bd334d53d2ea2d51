"""The log of a service: each line is JSON, errors have tracebacks, and strangers do not fill it."""

import json
import os
import subprocess
import sys
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import pytest

from service.server import RunningServer
from service.settings import Settings
from service.workers.fork_server import ForkServer
from tests.service.forking import running
from tests.service.sending import connected
from tests.service.support import TIMEOUT, until

# All that reports something without a logger of ours; the last ends the process.
REPORTED = r"""
import asyncio, logging, threading, warnings
from service import logs
logs.configure("info")
warnings.warn("deprecated\nthing")
warnings.warn("another thing")
logging.getLogger("library").warning(["no text"])
logging.getLogger("library").error("lost", exc_info=ValueError("of a library"))
def fail(what):
    raise ValueError(what)
thread = threading.Thread(target=fail, args=["in a thread"])
thread.start()
thread.join()
class Unraisable:
    def __del__(self):
        fail("in a finalizer")
Unraisable()
async def main():
    asyncio.get_running_loop().call_soon(fail, "on the loop")
    await asyncio.sleep(0)
    await asyncio.sleep(0)
asyncio.run(main())
fail("at the end")
"""
NO_REQUEST = b"\x16\x03\x01 this is no HTTP\r\n\r\n"
UPGRADE = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: upgrade\r\nUpgrade: websocket\r\n\r\n"
MANY = 300


class Unreadable:
    """An object that a process cannot unpack."""

    def __reduce__(self) -> Any:
        return int, ("no number",)


def lines_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


def messages(line: dict[str, Any]) -> list[str]:
    """Messages of the exceptions of a line, each of which has its traceback."""
    assert all(found["frames"] or found["exc_value"] == "of a library" for found in line["exception"])
    return [found["exc_value"] for found in line["exception"]]


def test_everything_reported_is_json_with_its_traceback() -> None:
    ran = subprocess.run(
        [sys.executable, "-c", REPORTED], check=False, capture_output=True, text=True, timeout=TIMEOUT
    )
    first, second, third, *errors = lines_of(ran.stderr)
    assert ["deprecated" in first["event"], "another" in second["event"]] == [True, True]
    assert "no text" in str(third["event"])
    said = [message for line in errors for message in messages(line)]
    assert said == ["of a library", "in a thread", "in a finalizer", "on the loop", "at the end"]
    assert (ran.returncode, ran.stdout) == (1, "")


@pytest.mark.slow
def test_fork_server_that_fails_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    broken = ForkServer()
    here, there = Pipe()
    with here, there:
        broken.fork(Unreadable(), there, there)  # type: ignore[arg-type]
    captured: list[str] = []
    until(lambda: bool(captured.append(capfd.readouterr().err) or "no number" in "".join(captured)))
    broken.kill()
    (line,) = lines_of("".join(captured))
    assert "no number" in messages(line)[0]


def test_settings_that_cannot_be_used_are_json(tmp_path: Path) -> None:
    environment = os.environ | {"PENUMBRA_DATA": str(tmp_path), "PENUMBRA_WORKERS": "many"}
    command = [sys.executable, "-m", "service"]
    ran = subprocess.run(
        command, env=environment, check=False, capture_output=True, text=True, timeout=TIMEOUT
    )
    (line,) = lines_of(ran.stderr)
    assert "workers" in messages(line)[0]


def send(server: RunningServer, content: bytes) -> None:
    with connected(server, content) as connection:
        connection.recv(1 << 16)


@pytest.mark.slow
def test_malformed_requests_are_counted_and_not_listed(tmp_path: Path) -> None:
    log = tmp_path / "log"
    settings = Settings(data=tmp_path / "data", port=0, workers=1, log_level="info")

    def counted() -> int:
        """Lines that stand for all that strangers have sent: one each, and a second one for upgrades.

        Others tell of requests made before the service was ready.
        """
        warnings = (line for line in lines_of(log.read_text()) if line["level"] == "warning")
        return sum(line.get("count", 1) for line in warnings if line["event"] != "request")

    with log.open("wb") as stderr, running(settings, stderr=stderr) as server:
        for _ in range(MANY):
            send(server, NO_REQUEST)
            send(server, UPGRADE)
        until(lambda: counted() == 3 * MANY)
    assert len(lines_of(log.read_text())) < MANY / 5
