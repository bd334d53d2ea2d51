"""Request bodies: checks of type, length and throughput while they arrive, and disconnections after them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager
from typing import Annotated, TypeVar

from anyio import CancelScope
from fastapi import Depends, Request
from starlette.requests import ClientDisconnect

from schemas.limits import Limits
from service.api.authentication import claimant_of
from service.api.middleware import end_turn
from service.api.request_headers import joined
from service.errors import (
    BodyIncompleteError,
    BodySlowError,
    BodyTooLargeError,
    DisconnectedError,
    MediaTypeError,
)
from service.jobs.context import Here

MIN_BODY_RATE = 16 * 1024
"""Least bytes per second of a body after ``first_seconds``: a modem is fast enough."""
# No real Content-Length has more digits.
_MOST_DIGITS = 18

Answer = TypeVar("Answer")


async def chunks(request: Request, limit: int, first_seconds: float) -> AsyncIterator[bytes]:
    """Iterate over a body as it arrives.

    Parameters
    ----------
    limit
        Most bytes.
    first_seconds
        Seconds that the first bytes may take, and each pause; all must arrive at `MIN_BODY_RATE` on average.

    Raises
    ------
    BodyTooLargeError
        As soon as it is known that the body has more than ``limit`` bytes.
    BodySlowError
        As soon as it is late.
    BodyIncompleteError
        If the connection ends first.
    MediaTypeError
        If it is compressed: a few bytes could unpack to any number.
    """
    if joined(request, "content-encoding").strip().lower() not in ("identity", ""):
        raise MediaTypeError("Send the body as it is, without Content-Encoding.")
    size = _announced(request)
    if size <= limit:
        size = 0
        async for chunk in _arriving(request, first_seconds):
            size += len(chunk)
            if size > limit:
                break
            yield chunk
    if size > limit:
        raise BodyTooLargeError(
            f"The body is longer than {limit:,} bytes. The service's operator can raise this limit."
        )


def _announced(request: Request) -> int:
    text = request.headers.get("content-length", "0")
    return int(text[:_MOST_DIGITS]) if text.isdecimal() else 0


async def _arriving(request: Request, first_seconds: float) -> AsyncIterator[bytes]:
    stream, size = request.stream(), 0
    now = asyncio.get_running_loop().time
    begun = now()
    await end_turn(request.scope)
    try:
        while True:
            # A fast body must not pause for the time that a slow one would have taken.
            async with asyncio.timeout_at(min(begun + size / MIN_BODY_RATE, now()) + first_seconds):
                chunk = await anext(stream, None)
            if chunk is None:
                return
            size += len(chunk)
            yield chunk
    except TimeoutError:
        raise BodySlowError("The body arrived too slowly. Send it again.") from None
    except ClientDisconnect:
        raise BodyIncompleteError("The connection ended before the body did.") from None


async def _json_body(request: Request, here: Here) -> AsyncIterator[bytes]:
    async with _json(request, here, here.settings.limits) as body:
        yield body


async def _trace_body(request: Request, here: Here) -> AsyncIterator[bytes]:
    async with _json(request, here, here.settings.trace_limits) as body:
        yield body


@asynccontextmanager
async def _json(request: Request, here: Here, limits: Limits) -> AsyncIterator[bytes]:
    """Return a JSON body without parsing it. A body without a type is accepted.

    Raises
    ------
    MediaTypeError
        If its type is not JSON.
    BusyError
        If all bodies together would need too much memory.
    """
    media_type = request.headers.get("content-type", "application/json").partition(";")[0].strip().lower()
    if media_type != "application/json" and not media_type.endswith("+json"):
        raise MediaTypeError("Send the body as application/json.")
    with here.body_memory.account(claimant_of(request)) as count_bytes:
        parts = []
        async for chunk in chunks(request, limits.max_body_bytes, here.settings.client_timeout_seconds):
            count_bytes(len(chunk))
            parts.append(chunk)
        # Kept to find lines for problems that are found later.
        request.state.body = b"".join(parts)
        yield request.state.body


JsonBody = Annotated[bytes, Depends(_json_body)]

TraceBody = Annotated[bytes, Depends(_trace_body)]
"""As long as the rays that a request may have need."""


async def while_connected(request: Request, answer: Awaitable[Answer]) -> Answer:
    """Await the answer to a request; cancel it as soon as the client disconnects.

    A running thread is awaited, unless it calls ``anyio.from_thread.check_cancelled``.

    Raises
    ------
    DisconnectedError
        Nobody receives it; it ends the handler.
    """
    with CancelScope() as scope:
        watching = asyncio.ensure_future(_cancel_at_end(request, scope))
        try:
            return await answer
        finally:
            watching.cancel()
    raise DisconnectedError("The client disconnected before the answer.")


async def _cancel_at_end(request: Request, scope: CancelScope) -> None:
    # After the body nothing is received but the end of the connection.
    while (await request.receive())["type"] != "http.disconnect":
        pass
    scope.cancel()
