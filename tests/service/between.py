"""A process between a server and its peer: it forwards everything, drops everything, or all for listeners.

``python -m tests.service.between TARGET [pools] [far]`` listens on a port of loopback, which it prints. A
process that is stopped closes no connection, and takes what is sent until its buffers are full: so a network
looks that is cut in two.
"""

import asyncio
import os
import signal
import subprocess
import sys
from contextlib import suppress

SIZE = 65536
FAR_SECONDS = 0.02


class Between:
    """The process, as those see it who start it.

    Parameters
    ----------
    target : str
        Path of a socket.
    pools : bool
        Whether PostgreSQL gets SELECT in place of LISTEN: a pool of transactions gives the next one another
        connection, which has not listened.
    far : bool
        Whether each answer takes `FAR_SECONDS` longer.
    """

    def __init__(self, target: str, *, pools: bool = False, far: bool = False) -> None:
        command = [sys.executable, "-m", __name__, target, *(["pools"] * pools), *(["far"] * far)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        self.port = int(self._process.stdout.readline())

    def swallow(self) -> None:
        """Pass nothing on from now on."""
        os.kill(self._process.pid, signal.SIGSTOP)

    def pass_on(self) -> None:
        """Pass on what was held back, and all that follows."""
        os.kill(self._process.pid, signal.SIGCONT)

    def deafen(self) -> None:
        """Drop all that the present connections to PostgreSQL send and get that have listened."""
        os.kill(self._process.pid, signal.SIGUSR1)

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


class _Passage:
    """One connection: whether its client has listened, and whether nothing is passed on any more."""

    listens = deaf = False

    def __init__(self, *, pools: bool) -> None:
        self._pools = pools

    async def pass_on(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, seconds: float = 0.0
    ) -> None:
        """Pass on until one side ends, and then end the other."""
        with suppress(OSError):
            while data := await reader.read(SIZE):
                await asyncio.sleep(seconds)
                self.listens |= b"LISTEN" in data
                if self._pools:
                    # Of the same length; what follows becomes the name of the column.
                    data = data.replace(b"LISTEN penumbra", b"SELECT 1       ")
                if not self.deaf:
                    writer.write(data)
                    await writer.drain()
        writer.close()


async def _run(target: str, *, pools: bool, seconds: float) -> None:
    passages: list[_Passage] = []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        passages.append(passage := _Passage(pools=pools))
        there_reader, there_writer = await asyncio.open_unix_connection(target)
        back = passage.pass_on(there_reader, writer, seconds)
        await asyncio.gather(passage.pass_on(reader, there_writer), back)

    def deafen() -> None:
        for passage in passages:
            passage.deaf = passage.listens

    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, deafen)
    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    sys.stdout.write(f"{server.sockets[0].getsockname()[1]}\n")
    sys.stdout.flush()
    await server.serve_forever()


if __name__ == "__main__":
    seconds = FAR_SECONDS if "far" in sys.argv[2:] else 0.0
    asyncio.run(_run(sys.argv[1], pools="pools" in sys.argv[2:], seconds=seconds))
