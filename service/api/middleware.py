"""Middleware: request ids, headers that browsers need, and a timeout for idle connections."""

from __future__ import annotations

import asyncio
import re
import secrets
import time

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

HEADER = "X-Request-ID"
_GOOD = re.compile(r"[A-Za-z0-9._-]{1,64}")
"""Request ids that are safe in a log and in a header."""

log = structlog.get_logger()


class RequestIds:
    """Takes the id that the client sends, or makes one, and logs how each request ended."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        name = _name(Headers(scope=scope).get(HEADER, ""))
        started = time.monotonic()
        status = 0

        async def named(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = name
            await send(message)

        with structlog.contextvars.bound_contextvars(request=name):
            try:
                await self.app(scope, receive, named)
            finally:
                _log(scope, status, time.monotonic() - started)


def _name(given: str) -> str:
    return given if _GOOD.fullmatch(given) else secrets.token_hex(8)


def _log(scope: Scope, status: int, seconds: float) -> None:
    # Watchers poll all the time: success is logged for debugging only.
    say = log.warning if status >= 500 else log.debug
    say("request", method=scope["method"], path=scope["path"], status=status, seconds=round(seconds, 4))


ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    # Plots in SVG have styles of their own. The page has a policy that lets its scripts run.
    "Content-Security-Policy": (
        "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
}
"""Default headers of an answer."""

_OF_USERS = ("/v1/", "/metrics")


class SafeHeaders:
    """Adds security headers to the answers of all routes, errors included."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def completed(message: Message) -> None:
            if message["type"] == "http.response.start":
                _complete(MutableHeaders(scope=message), scope["path"])
            await send(message)

        await self.app(scope, receive, completed)


def _complete(headers: MutableHeaders, path: str) -> None:
    for name, value in ALWAYS.items():
        headers.setdefault(name, value)
    if not path.startswith(_OF_USERS):
        return
    # An answer depends on a key or a cookie: no cache may keep it for other users.
    rule = headers.get("Cache-Control")
    headers["Cache-Control"] = f"private, {rule}" if rule else "no-store"


def slow_client_protocol(seconds: float) -> type[H11Protocol]:
    """Make a protocol that closes a connection on which no head of a request is complete in time.

    Otherwise a few clients could hold all connections there may be. Uvicorn has no such limit: its
    ``timeout_keep_alive`` begins with the end of an answer, so it never closes a connection that has sent
    nothing yet, and it ends with the next byte; ``h11_max_incomplete_event_size`` bounds the bytes of a head,
    and not how long it takes to come.

    Parameters
    ----------
    seconds
        From the beginning of the connection, or from the end of the answer before.
    """

    class SlowClientProtocol(H11Protocol):
        _timer: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._start()

        def connection_lost(self, exc: Exception | None) -> None:
            super().connection_lost(exc)
            self._stop()

        def on_response_complete(self) -> None:
            super().on_response_complete()
            self._start()

        def _start(self) -> None:
            self._stop()
            self._timer = self.loop.call_later(seconds, self._close_if_idle)

        def _stop(self) -> None:
            if self._timer is not None:
                self._timer.cancel()

        def _close_if_idle(self) -> None:
            cycle: RequestResponseCycle | None = self.cycle
            if (cycle is None or cycle.response_complete) and not self.transport.is_closing():
                self.transport.close()

    return SlowClientProtocol
