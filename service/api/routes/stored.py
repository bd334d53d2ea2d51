"""Answers with what lies in the store: whole, or the bytes that a request asks for (RFC 9110, section 14)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from email.utils import formatdate
from itertools import pairwise
from secrets import token_hex

from fastapi import Request
from fastapi.responses import FileResponse, Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from service.errors import RangeError
from service.storage.objects import Stored

RANGE = re.compile(r"(\d{1,18})-(\d{0,18})|-(\d{1,18})", re.ASCII)
MOST_RANGES = 10
"""Whoever asks for more parts at once gets the whole: it is less work."""
PIECE = 4 << 20
"""Bytes that are fetched from a bucket at once."""

Span = tuple[int, int]
"""The first byte and the one after the last."""


def stored_response(
    request: Request, stored: Stored, media_type: str, headers: Mapping[str, str]
) -> Response:
    """Answer with what lies in the store; a bucket's objects are answered as files are.

    Raises
    ------
    RangeError
        If ranges that are asked for make no sense, or all begin after the end.
    """
    told = {
        **headers,
        "Accept-Ranges": "bytes",
        "Last-Modified": formatdate(stored.modified, usegmt=True),
    }
    spans = _asked_spans(request, told, stored.size)
    if stored.path is not None and not spans:
        return _WholeFile(stored.path, media_type=media_type, headers=told)
    return _Parts(stored, media_type, told, request.method).answer(spans)


class _WholeFile(FileResponse):
    """A file whose ranges do not count here, or were not asked for."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        headers = [(name, value) for name, value in scope["headers"] if name != b"range"]
        await super().__call__({**scope, "headers": headers}, receive, send)


def _asked_spans(request: Request, told: Mapping[str, str], size: int) -> list[Span]:
    """Give the spans that a request asks for; none where it gets the whole.

    That is so without a range, with one of another unit, for methods other than GET, where `If-Range` names
    another version, and where there are many.
    """
    unit, _, ranges = request.headers.get("range", "").partition("=")
    if unit.strip().lower() != "bytes" or request.method != "GET":
        return []
    if not _holds(request.headers.get("if-range"), told):
        return []
    parts = [part.strip() for part in ranges.split(",") if part.strip()]
    return _joined(parts, size) if len(parts) <= MOST_RANGES else []


def _joined(parts: list[str], size: int) -> list[Span]:
    """Read ranges: in order, those that touch each other joined, those after the end left out."""
    joined: list[Span] = []
    for begin, end in sorted(_span(part, size) for part in parts):
        if begin >= end:
            continue
        if joined and begin <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(joined[-1][1], end)
        else:
            joined.append((begin, end))
    if not joined:
        raise RangeError(size)
    return joined


def _span(part: str, size: int) -> Span:
    """Read one range; it is empty where it begins after the end."""
    read = RANGE.fullmatch(part)
    if read is None:
        raise RangeError(size)
    first, last, count = read.groups()
    if count is not None:
        return max(0, size - int(count)), size
    if last and int(last) < int(first):
        raise RangeError(size)
    return int(first), min(int(last) + 1, size) if last else size


def _holds(if_range: str | None, told: Mapping[str, str]) -> bool:
    """Whether whoever asks for a part has other parts of the same thing."""
    return if_range is None or if_range in (told["ETag"], told["Last-Modified"])


class _Parts:
    """The parts of an object, fetched while they are sent."""

    def __init__(self, stored: Stored, media_type: str, headers: dict[str, str], method: str) -> None:
        self._stored, self._media_type, self._headers = stored, media_type, headers
        self._bodiless = method == "HEAD"

    def answer(self, spans: list[Span]) -> Response:
        size = self._stored.size
        if not spans:
            return self._stream(200, [(0, size)], self._media_type, {})
        if len(spans) == 1:
            [(begin, end)] = spans
            return self._stream(206, spans, self._media_type, {"Content-Range": _place(begin, end, size)})
        return self._several(spans)

    def _several(self, spans: list[Span]) -> Response:
        boundary = token_hex(13)
        heads = [
            f"--{boundary}\r\nContent-Type: {self._media_type}\r\n"
            f"Content-Range: {_place(*span, self._stored.size)}\r\n\r\n"
            for span in spans
        ]
        tail = f"--{boundary}--"
        return self._stream(206, spans, f"multipart/byteranges; boundary={boundary}", {}, (*heads, tail))

    def _stream(
        self,
        status: int,
        spans: list[Span],
        media_type: str,
        headers: dict[str, str],
        between: tuple[str, ...] = (),
    ) -> Response:
        length = sum(end - begin for begin, end in spans) + sum(map(len, between))
        length += 2 * len(spans) if between else 0
        told = self._headers | headers | {"Content-Length": str(length)}
        if self._bodiless:
            return Response(status_code=status, media_type=media_type, headers=told)
        # The first piece is fetched before the answer begins: a bucket that is away is a problem then.
        pieces = self._pieces(spans, between)
        first = next(pieces, b"")
        return StreamingResponse(
            _chained(first, pieces), status_code=status, media_type=media_type, headers=told
        )

    def _pieces(self, spans: list[Span], between: tuple[str, ...]) -> Iterator[bytes]:
        for number, (begin, end) in enumerate(spans):
            head = between[number].encode() if between else b""
            for start, stop in pairwise([*range(begin, end, PIECE), end]):
                yield head + self._stored.read(start, stop)
                head = b""
            if between:
                yield b"\r\n"
        if between:
            yield between[-1].encode()


def _place(begin: int, end: int, size: int) -> str:
    return f"bytes {begin}-{end - 1}/{size}"


def _chained(first: bytes, rest: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    yield from rest
