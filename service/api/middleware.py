"""Middleware: request ids, trusted proxies, turns of clients, absolute targets, and headers for browsers."""

from __future__ import annotations

import asyncio
import re
import secrets
import time
from collections.abc import Sequence
from contextlib import AsyncExitStack
from http import HTTPStatus
from urllib.parse import unquote
from weakref import WeakValueDictionary

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from service.logs import bursts

HEADER = "X-Request-ID"
_GOOD = re.compile(r"[A-Za-z0-9._-]{1,64}")
"""Request ids that are safe in a log and in a header."""
BY_PROXY = "penumbra.by_proxy"
"""Name in the scope of a request that marks one from a trusted proxy."""
TURN_KEY = "penumbra.turn"
AT_ONCE = 8
"""Requests of one client that are handled at once. There are 40 threads, and Python runs one at a time."""
_ABSOLUTE = re.compile(rb"https?://([^/]*)(.*)", re.IGNORECASE)

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
        name = request_id(Headers(scope=scope).get(HEADER, ""))
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
                _log(scope, name, status, time.monotonic() - started)


def request_id(given: str = "") -> str:
    """Return the id that a client has sent, or a new one."""
    return given if _GOOD.fullmatch(given) else secrets.token_hex(8)


def _log(scope: Scope, name: str, status: int, seconds: float) -> None:
    details = {"request": name, "method": scope["method"], "path": scope["path"], "status": status}
    details["seconds"] = round(seconds, 4)
    if status < 500:
        # Watchers poll all the time: success is logged for debugging only.
        log.debug("request", **details)
    elif status == HTTPStatus.SERVICE_UNAVAILABLE:
        # Anybody may exceed the limit of connections.
        bursts.write(("request", status), lambda more: log.warning("request", **details, **more))
    else:
        log.warning("request", **details)


class TrustedProxies:
    """Believes trusted proxies about TLS and the addresses of clients, and marks requests that come by them.

    Parameters
    ----------
    trusted : sequence of str
        Addresses and networks of the proxies.
    """

    def __init__(self, app: ASGIApp, trusted: Sequence[str]) -> None:
        self._believing = ProxyHeadersMiddleware(app, list(trusted))  # type: ignore[arg-type]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        peer = scope.get("client")
        scope[BY_PROXY] = peer is not None and peer[0] in self._believing.trusted_hosts
        await self._believing(scope, receive, send)  # type: ignore[arg-type]


class Turns:
    """Lets few requests of one client be handled at once, so that those of others find threads.

    A request has its turn until its answer begins, or until it waits for something: see `end_turn`. Clients
    are told apart by their keys and cookies, or by their addresses.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._of: WeakValueDictionary[str, asyncio.Semaphore] = WeakValueDictionary()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if not scope.get("path", "").startswith("/v1/"):
            await self.app(scope, receive, send)
            return
        turns = self._of.setdefault(_client(scope), asyncio.Semaphore(AT_ONCE))
        async with AsyncExitStack() as turn:
            await turn.enter_async_context(turns)

            async def started(message: Message) -> None:
                await turn.aclose()
                await send(message)

            await self.app({**scope, TURN_KEY: turn}, receive, started)


def _client(scope: Scope) -> str:
    headers = Headers(scope=scope)
    address = scope["client"][0] if scope.get("client") else ""
    return headers.get("authorization") or headers.get("cookie") or address


async def end_turn(scope: Scope) -> None:
    """Let another request of the client be handled: this one waits, for its body or for an answer."""
    if TURN_KEY in scope:
        await scope[TURN_KEY].aclose()


class OriginForm:
    """Splits a target in absolute form, whose host takes the place of ``Host`` (RFC 9112, section 3.2.2)."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        found = _ABSOLUTE.fullmatch(scope.get("raw_path") or b"")
        if found:
            host, path = found[1], found[2] or b"/"
            others = [header for header in scope["headers"] if header[0] != b"host"]
            target = {"raw_path": path, "path": unquote(path.decode("ascii"))}
            scope = {**scope, **target, "headers": [(b"host", host), *others]}
        await self.app(scope, receive, send)


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
