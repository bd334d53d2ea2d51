"""Reading request bodies: their type is checked, and their length while they arrive."""

from __future__ import annotations

from collections.abc import AsyncIterator

from fastapi import Request
from starlette.requests import ClientDisconnect

from service.errors import BodyIncompleteError, BodyTooLargeError, MediaTypeError


async def chunks(request: Request, limit: int) -> AsyncIterator[bytes]:
    """Iterate over a body as it arrives.

    Raises
    ------
    BodyTooLargeError
        As soon as it is known that the body has more than ``limit`` bytes.
    BodyIncompleteError
        If the connection ends first.
    """
    size = int(request.headers.get("content-length", "0"))
    try:
        if size <= limit:
            size = 0
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    break
                yield chunk
    except ClientDisconnect:
        raise BodyIncompleteError("The connection ended before the body did.") from None
    if size > limit:
        raise BodyTooLargeError(f"The body is longer than {limit} bytes.")


async def json_body(request: Request, limit: int) -> bytes:
    """Return a body that is said to be JSON; it is not parsed.

    Raises
    ------
    MediaTypeError
        If its type is not JSON. A body without a type is taken.
    """
    media_type = request.headers.get("content-type", "application/json").partition(";")[0].strip().lower()
    if media_type != "application/json" and not media_type.endswith("+json"):
        raise MediaTypeError("Send the body as application/json.")
    return b"".join([chunk async for chunk in chunks(request, limit)])
