"""An S3-compatible server for the tests, in its own process on loopback.

That is moto's server, which keeps everything in memory; or, where ``S3_TESTS_S3RVER`` names its program,
s3rver, which keeps files and checks signatures.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import httpx2

S3RVER = "S3_TESTS_S3RVER"
BUCKET = "penumbra-tests"
START_SECONDS = 60.0
RELAY = """
import asyncio, sys
async def pump(source, sink):
    try:
        while data := await source.read(65536):
            sink.write(data)
            await sink.drain()
    except OSError:
        pass
    sink.close()
async def serve(reader, writer):
    there, back = await asyncio.open_connection("127.0.0.1", int(sys.argv[2]))
    await asyncio.gather(pump(reader, back), pump(there, writer))
async def main():
    server = await asyncio.start_server(serve, "127.0.0.1", int(sys.argv[1]))
    await server.serve_forever()
asyncio.run(main())
"""


class S3Server:
    """A server with one empty bucket, and a way to it that can be cut, or stall.

    Attributes
    ----------
    url
        Of the way.
    """

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="s3-"))
        port, self._port = _free_port(), _free_port()
        self.url = f"http://127.0.0.1:{self._port}"
        self._target = port
        self._process = _start(*_program(port, self._folder))
        self.begin()
        _wait(self._has_bucket)

    def environment(self) -> dict[str, str]:
        """The variables by which its users find it."""
        return {
            "AWS_ENDPOINT_URL": self.url,
            "AWS_ACCESS_KEY_ID": "S3RVER",
            "AWS_SECRET_ACCESS_KEY": "S3RVER",
            "AWS_REGION": "us-east-1",
        }

    def _has_bucket(self) -> bool:
        # moto creates it on any request; s3rver starts with it, and refuses unsigned requests.
        return httpx2.put(f"{self.url}/{BUCKET}", timeout=5.0).status_code in {200, 403, 409}

    def begin(self) -> None:
        """Open the way to it."""
        self._way = _start(sys.executable, "-c", RELAY, str(self._port), str(self._target))
        _wait(lambda: _listens(self._port))

    def cut(self) -> None:
        """Break all connections, and let in no others."""
        _end(self._way)

    def stall(self) -> None:
        """Pass nothing on and break nothing: who asks gets no answer."""
        os.kill(self._way.pid, signal.SIGSTOP)

    def resume(self) -> None:
        """Pass on what was held back, and all that follows."""
        os.kill(self._way.pid, signal.SIGCONT)

    def close(self) -> None:
        _end(self._way)
        _end(self._process)
        shutil.rmtree(self._folder)


def _program(port: int, folder: Path) -> list[str]:
    s3rver = os.environ.get(S3RVER)
    if s3rver:
        return [s3rver, "-d", str(folder), "-a", "127.0.0.1", "-p", str(port), "--configure-bucket", BUCKET]
    return [sys.executable, "-W", "ignore", "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]


def _start(*command: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def _wait(there: Callable[[], bool]) -> None:
    deadline = time.monotonic() + START_SECONDS
    while time.monotonic() < deadline:
        try:
            if there():
                return
        except httpx2.TransportError:
            pass
        time.sleep(0.05)
    raise TimeoutError("The S3 server of the tests did not start.")


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
