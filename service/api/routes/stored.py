"""Responses with stored files: whole, or a requested range (RFC 9110, section 14)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from email.utils import formatdate
from itertools import pairwise

from fastapi import Request
from fastapi.responses import FileResponse, Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from service.errors import RangeError
from service.storage.objects import Stored

RANGE = re.compile(r"(\d{1,18})-(\d{0,18})|-(\d{1,18})", re.ASCII)
PIECE = 4 << 20
"""Bytes that are fetched from a bucket at once."""

Span = tuple[int, int]
"""The first byte and the one after the last."""


def stored_response(
    request: Request, stored: Stored, media_type: str, headers: Mapping[str, str]
) -> Response:
    """Answer with a file of the store, or an object of its bucket.

    Raises
    ------
    RangeError
        If the requested range is malformed, or begins after the end.
    """
    fields = {
        **headers,
        "Accept-Ranges": "bytes",
        "Last-Modified": formatdate(stored.modified, usegmt=True),
    }
    span = _asked_span(request, fields, stored.size)
    if span is not None:
        begin, end = span
        fields["Content-Range"] = f"bytes {begin}-{end - 1}/{stored.size}"
        return streamed(206, stored, span, media_type, fields)
    if stored.path is not None:
        return _WholeFile(stored.path, media_type=media_type, headers=fields)
    if request.method == "HEAD":
        return Response(media_type=media_type, headers=fields | {"Content-Length": str(stored.size)})
    return streamed(200, stored, (0, stored.size), media_type, fields)


class _WholeFile(FileResponse):
    """A file served whole, because no range applies."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        headers = [(name, value) for name, value in scope["headers"] if name != b"range"]
        await super().__call__({**scope, "headers": headers}, receive, send)


def _asked_span(request: Request, fields: Mapping[str, str], size: int) -> Span | None:
    """Return the requested span, or None for the whole file.

    That is so without a range, with one of another unit, for methods other than GET, where `If-Range` names
    another version, and where several are requested: a server may ignore them (section 14.2).
    """
    unit, _, ranges = request.headers.get("range", "").partition("=")
    if unit.strip().lower() != "bytes" or request.method != "GET":
        return None
    if not _holds(request.headers.get("if-range"), fields):
        return None
    parts = [part.strip() for part in ranges.split(",") if part.strip()]
    return None if len(parts) > 1 else _span("".join(parts), size)


def _span(part: str, size: int) -> Span:
    read = RANGE.fullmatch(part)
    if read is None:
        raise RangeError(size)
    first, last, count = read.groups()
    begin = int(first) if first else max(0, size - int(count))
    end = min(int(last) + 1, size) if last else size
    if begin >= end:
        raise RangeError(size)
    return begin, end


def _holds(if_range: str | None, fields: Mapping[str, str]) -> bool:
    """Whether the client has parts of the same version."""
    return if_range is None or if_range in (fields["ETag"], fields["Last-Modified"])


def streamed(status: int, stored: Stored, span: Span, media_type: str, headers: dict[str, str]) -> Response:
    """Answer with some bytes of a file, of which few are in memory at once."""
    begin, end = span
    pieces = (stored.read(*ends) for ends in pairwise([*range(begin, end, PIECE), end]))
    # Fetch the first piece before the answer begins, so that an unreachable bucket gives a problem document.
    content = _chained(next(pieces, b""), pieces)
    fields = headers | {"Content-Length": str(end - begin)}
    return StreamingResponse(content, status_code=status, media_type=media_type, headers=fields)


def _chained(first: bytes, rest: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    yield from rest
