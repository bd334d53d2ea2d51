"""Responses with stored files: whole, or a requested range (RFC 9110, sections 13 and 14)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from email.utils import formatdate
from itertools import pairwise

from fastapi import Request
from fastapi.responses import Response, StreamingResponse

from service.api.request_headers import check_preconditions, joined
from service.errors import RangeError
from service.storage.objects import Stored

RANGE = re.compile(r"(\d{1,18})-(\d{0,18})|-(\d{1,18})", re.ASCII)
PIECE_BYTES = 1 << 20
"""Bytes that are read at once: as much memory as each slow client takes."""

Span = tuple[int, int]
"""The first byte and the one after the last."""


def stored_response(
    request: Request, stored: Stored, media_type: str, headers: Mapping[str, str]
) -> Response:
    """Answer with a file of the store, or an object of its bucket.

    Raises
    ------
    PreconditionFailedError
        If the request is for another version.
    RangeError
        If the requested range is malformed, or begins after the end.
    FileNotFoundError
        If it was deleted from its bucket meanwhile.
    """
    fields = {**headers, "Accept-Ranges": "bytes"}
    if stored.modified is not None:
        fields["Last-Modified"] = formatdate(stored.modified, usegmt=True)
    unchanged = check_preconditions(request, fields)
    if unchanged is not None:
        return unchanged
    span = _asked_span(request, fields, stored.size)
    if span is not None:
        begin, end = span
        fields["Content-Range"] = f"bytes {begin}-{end - 1}/{stored.size}"
        return streamed(206, stored, span, media_type, fields)
    if request.method == "HEAD":
        return Response(media_type=media_type, headers=fields | {"Content-Length": str(stored.size)})
    return streamed(200, stored, (0, stored.size), media_type, fields)


def _asked_span(request: Request, fields: Mapping[str, str], size: int) -> Span | None:
    """Return the requested span, or None for the whole file.

    That is so without a range, with one of another unit, for methods other than GET, where `If-Range` names
    another version, and where several are requested: a server may ignore them (section 14.2).
    """
    unit, _, ranges = joined(request, "range").partition("=")
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
    return if_range is None or if_range in (fields["ETag"], fields.get("Last-Modified"))


def streamed(status: int, stored: Stored, span: Span, media_type: str, headers: dict[str, str]) -> Response:
    """Answer with some bytes of a file, of which few are in memory at once."""
    begin, end = span
    spans = [*pairwise([*range(begin, end, PIECE_BYTES), end])]
    pieces = (stored.read(*ends) for ends in spans)
    for ends in spans[1:] if stored.read_ahead else ():
        stored.read(*ends)
    # Fetch the first piece before the answer begins, so that an unreachable bucket gives a problem document.
    first = next(pieces, b"")
    if end - begin <= PIECE_BYTES:
        return Response(first, status, headers, media_type)
    fields = headers | {"Content-Length": str(end - begin)}
    return StreamingResponse(_chained(first, pieces), status, fields, media_type)


def _chained(first: bytes, rest: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    yield from rest
