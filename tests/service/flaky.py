"""A TCP proxy that breaks connections like bad networks and busy proxies."""

import socket
import struct
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

# Closing a socket that lingers for no time sends a reset.
RESET = struct.pack("ii", 1, 0)


@dataclass(frozen=True)
class Cut:
    """Break the connection after so many bytes of answers."""

    after: int


@dataclass(frozen=True)
class Say:
    """Answer the first request so, in place of the server, and close the connection."""

    answer: bytes


@dataclass(frozen=True)
class Change:
    """Change the byte after so many bytes of answers."""

    after: int


Fault = Cut | Say | Change | None


def busy(status: int, retry_after: str) -> Say:
    """The answer of a proxy whose server is down."""
    page = b"<h1>Not now</h1>"
    head = f"HTTP/1.1 {status} Not now\r\nContent-Type: text/html\r\nRetry-After: {retry_after}\r\n"
    return Say(head.encode() + b"Content-Length: %d\r\nConnection: close\r\n\r\n" % len(page) + page)


@dataclass
class Flaky:
    """Passes bytes on between clients and a server, with one fault for each connection while there are some.

    Attributes
    ----------
    faults
        What is wrong with the next connections.
    requests
        What clients have sent, piece by piece.
    open
        Connections that no side has closed.
    """

    server: tuple[str, int]
    faults: deque[Fault] = field(default_factory=deque)
    requests: list[bytes] = field(default_factory=list)
    open: int = 0

    def __post_init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        self._start(self._accept)

    def close(self) -> None:
        # Closing alone does not wake the thread that waits in accept.
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _start(self, target: Any, *arguments: Any) -> threading.Thread:
        thread = threading.Thread(target=target, args=arguments, daemon=True)
        thread.start()
        return thread

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            self._start(self._serve, client, self.faults.popleft() if self.faults else None)

    def _serve(self, client: socket.socket, fault: Fault) -> None:
        self.open += 1
        with client:
            first = client.recv(65536)
            self.requests.append(first)
            if isinstance(fault, Say):
                client.sendall(fault.answer)
            else:
                with socket.create_connection(self.server) as server:
                    server.sendall(first)
                    passing = self._start(self._pass, client, server)
                    self._answer(server, client, fault)
                    # A socket is not closed while a thread still reads from it.
                    _stop_reading(client)
                    passing.join()
        self.open -= 1

    def _pass(self, client: socket.socket, server: socket.socket) -> None:
        """Pass requests on; at their end the server learns of it."""
        with suppress(OSError):
            while data := _received(client):
                self.requests.append(data)
                server.sendall(data)
            server.shutdown(socket.SHUT_RDWR)

    def _answer(self, server: socket.socket, client: socket.socket, fault: Cut | Change | None) -> None:
        left = fault.after if isinstance(fault, Cut) else None
        place = fault.after if isinstance(fault, Change) else -1
        while data := _received(server):
            if 0 <= place < len(data):
                data = data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :]
            place -= len(data)
            try:
                client.sendall(data[:left])
            except OSError:
                return
            if left is not None:
                left -= min(left, len(data))
                if left == 0:
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
                    return


def _stop_reading(source: socket.socket) -> None:
    with suppress(OSError):
        source.shutdown(socket.SHUT_RD)


def _received(source: socket.socket) -> bytes:
    try:
        return source.recv(65536)
    except OSError:
        return b""
