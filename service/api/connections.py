"""Connection limits: of all clients, of one address, and of idle time."""

from __future__ import annotations

import asyncio
import math
import sys
from http import HTTPStatus

import h11
import structlog
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from service.api import problems
from service.api.bodies import MIN_BODY_RATE
from service.api.middleware import ALWAYS, HEADER, RequestIds, SafeHeaders, request_id
from service.errors import BusyError, UnavailableError
from service.jobs.request_limits import SharedRoom
from service.settings import Settings

PROBES = ("/livez", "/readyz")
"""Paths that are also answered beyond the limits."""
MOST_PROBES = 32
"""Connections beyond the limits, only for probes."""

HALF_CLOSED_SECONDS = 1.0
"""Seconds until a client that closed its side counts as gone. It may still read; most answers come sooner."""

log = structlog.get_logger()

MALFORMED = "This is no request of HTTP/1.1, or its head is too long."
CROWDED = "The service is at its connection limit. Try again in a moment."
CROWDED_ADDRESS = (
    "Your address has {} connections to this service, the maximum at the moment. Close some of them, or send "
    "several requests on one."
)


class Connection(H11Protocol):
    """A counted connection, with timeouts for the head of a request and for reading the answer.

    Otherwise a few clients could hold all connections. Uvicorn has no such timeouts: it waits for readers for
    ever; its ``timeout_keep_alive`` begins at the end of an answer and ends with the next byte, so it never
    closes a connection that sent nothing; ``h11_max_incomplete_event_size`` bounds the bytes of a head, not
    its time; and ``limit_concurrency`` refuses probes too.
    """

    limits: ConnectionLimits
    _timer: asyncio.TimerHandle | None = None
    _reader: asyncio.TimerHandle | None = None
    _is_half_closed = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request, if there is room for another connection."""
        super().connection_made(transport)
        self._start()
        refusal = self.limits.enter(self)
        if refusal is not None:
            self.app = _ProbesAlone(self.app, refusal)

    def connection_lost(self, exc: Exception | None) -> None:
        """Make room for another connection."""
        super().connection_lost(exc)
        self.resume_writing()
        self._stop()
        self.limits.leave(self)

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._start()
        if self._is_half_closed:
            self.close_if_idle()

    def pause_writing(self) -> None:
        """Begin to watch a client that does not read its answer as fast as it is sent."""
        super().pause_writing()
        self._watch_reader(math.inf)

    def resume_writing(self) -> None:
        """Go on: the client has read nearly all that was sent."""
        super().resume_writing()
        if self._reader is not None:
            self._reader.cancel()

    def _watch_reader(self, before: float) -> None:
        """Give up a client that has read too little since the last time; nothing is added meanwhile."""
        left, seconds = self.transport.get_write_buffer_size(), self.limits.idle_seconds
        if before - left < MIN_BODY_RATE * seconds:
            self.transport.abort()
        else:
            self._reader = self.loop.call_later(seconds, self._watch_reader, left)

    def eof_received(self) -> bool:  # type: ignore[override]
        """Keep the connection of a client that reads the answer to its last request; say whether."""
        cycle: RequestResponseCycle | None = self.cycle
        if cycle is None or cycle.response_complete or cycle.more_body:
            return False
        if not self._is_half_closed:
            self._is_half_closed = True
            self.loop.call_later(HALF_CLOSED_SECONDS, self._close_half_closed)
        return True

    def _close_half_closed(self) -> None:
        # As long as there is something to send, sending it shows whether the client is there.
        if self.transport.get_write_buffer_size():
            self.loop.call_later(HALF_CLOSED_SECONDS, self._close_half_closed)
        else:
            self.transport.close()

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002  (an interface)
        """Answer malformed requests with a problem document, unless an answer has begun."""
        error = sys.exception()
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            status = getattr(error, "error_status_hint", 400)
            headers = ALWAYS | {HEADER: request_id(), "Connection": "close"}
            log.debug("request", request=headers[HEADER], status=status, error=str(error))
            answer = problems.answer(status, MALFORMED, code="malformed", headers=headers)
            phrase = HTTPStatus(status).phrase.encode()
            start = h11.Response(status_code=status, headers=answer.raw_headers, reason=phrase)
            for event in (start, h11.Data(data=bytes(answer.body)), h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    @property
    def address(self) -> str:
        """The address of the client."""
        return self.client[0] if self.client else ""

    def close_if_idle(self) -> bool:
        """Close the connection unless a request is being answered; say whether it is closed."""
        cycle: RequestResponseCycle | None = self.cycle
        if cycle is not None and not cycle.response_complete:
            return False
        if not self.transport.is_closing():
            self.transport.close()
        return True

    def _end_if_idle(self) -> None:
        # An answer that ended so long ago and is not read yet is not waited for.
        if self.close_if_idle():
            self.transport.abort()

    def _start(self) -> None:
        self._stop()
        self._timer = self.loop.call_later(self.limits.idle_seconds, self._end_if_idle)

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()


class ConnectionLimits:
    """Counts the connections of a server. Used by one thread, that of the event loop.

    Beyond the limits there are a few more, on which only probes are answered. The oldest of them that is idle
    makes room for the next: a client that holds them keeps no probe out.

    Parameters
    ----------
    most : int
        Connections of all clients, which addresses share.
    most_of_address : int or None
        Connections of one address; None if all have that of a proxy.
    idle_seconds : float
        Longest time of a connection without a request, from its beginning or from the end of an answer.
    """

    def __init__(self, most: int, most_of_address: int | None, idle_seconds: float) -> None:
        self.idle_seconds = idle_seconds
        self._room, self._most_of_address = SharedRoom(most), most_of_address
        self._within: set[Connection] = set()
        # In the order in which they came.
        self._beyond: dict[Connection, None] = {}

    def enter(self, connection: Connection) -> Exception | None:
        """Count a connection; beyond a limit, return the answer to everything but probes."""
        claimant = self._claimant(connection)
        held = self._room.held(claimant)
        if held < (self._most_of_address or math.inf) and self._room.take(claimant):
            self._within.add(connection)
            return None
        self._beyond[connection] = None
        if len(self._beyond) > MOST_PROBES:
            # It came last, and closes only where all others are being answered.
            closed = next(other for other in self._beyond if other.close_if_idle())
            del self._beyond[closed]
        return BusyError(CROWDED_ADDRESS.format(held)) if held else UnavailableError(CROWDED)

    def _claimant(self, connection: Connection) -> str:
        return str(id(connection)) if self._most_of_address is None else connection.address

    def leave(self, connection: Connection) -> None:
        """Remove a connection from the count."""
        self._beyond.pop(connection, None)
        if connection in self._within:
            self._within.remove(connection)
            self._room.give_back(self._claimant(connection))


class _ProbesAlone:
    """Answers probes as an application does, and everything else with an error."""

    def __init__(self, app: ASGIApp, error: Exception) -> None:
        self._app = app
        answer = problems.refusal(error, {"Connection": "close"})
        self._refusal = RequestIds(SafeHeaders(answer))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        answer = self._app if scope.get("path") in PROBES else self._refusal
        await answer(scope, receive, send)


def connection_type(settings: Settings) -> type[H11Protocol]:
    """Make the protocol of a server's connections. Behind a proxy all have the same address."""
    proxied = settings.behind_proxy or settings.trusted_proxies
    most_of_address = None if proxied else settings.max_address_connections

    class LimitedConnection(Connection):
        limits = ConnectionLimits(settings.max_connections, most_of_address, settings.client_timeout_seconds)

    return LimitedConnection
