"""A process between a server and its peer: it forwards everything, or drops everything.

``python -m tests.service.between TARGET`` listens on a port of loopback, which it prints. A process that
is stopped closes no connection, and takes what is sent until its buffers are full: so a network looks that
is cut in two.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from contextlib import suppress

SIZE = 65536


class Between:
    """The process, as those see it who start it.

    Parameters
    ----------
    target : str
        Path of a socket.
    """

    def __init__(self, target: str) -> None:
        self._process = subprocess.Popen([sys.executable, "-m", __name__, target], stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        self.port = int(self._process.stdout.readline())

    def swallow(self) -> None:
        """Pass nothing on from now on."""
        os.kill(self._process.pid, signal.SIGSTOP)

    def pass_on(self) -> None:
        """Pass on what was held back, and all that follows."""
        os.kill(self._process.pid, signal.SIGCONT)

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


async def _run(target: str) -> None:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there_reader, there_writer = await asyncio.open_unix_connection(target)
        await asyncio.gather(_pass(reader, there_writer), _pass(there_reader, writer))

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    sys.stdout.write(f"{server.sockets[0].getsockname()[1]}\n")
    sys.stdout.flush()
    await server.serve_forever()


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass on until one side ends, and then end the other."""
    with suppress(OSError):
        while data := await reader.read(SIZE):
            writer.write(data)
            await writer.drain()
    writer.close()


if __name__ == "__main__":
    asyncio.run(_run(sys.argv[1]))
