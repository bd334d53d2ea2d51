"""Request headers of several lines, and conditional requests (RFC 9110, sections 5.3 and 13)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime

from fastapi import Request
from fastapi.responses import Response
from starlette.datastructures import Headers
from starlette.staticfiles import NotModifiedResponse

from service.errors import PreconditionFailedError

TAG = re.compile(r'(W/)?("[^"]*")')


def joined(request: Request, name: str) -> str:
    """Return a list header, with all its lines joined; empty if it is missing."""
    return ", ".join(request.headers.getlist(name))


def check_preconditions(request: Request, headers: Mapping[str, str]) -> Response | None:
    """Answer 304 where the client has this version already; None if the request is to be answered.

    Parameters
    ----------
    headers
        Those of the answer: a strong ``ETag``, and ``Last-Modified`` if a date distinguishes versions; empty
        if there is no version yet.

    Raises
    ------
    PreconditionFailedError
        If the client asks for another version, or is to replace one that it does not expect.
    """
    tag, changed, sent = headers.get("ETag"), headers.get("Last-Modified"), request.headers
    # Dates count only where no tags are sent (section 13.2.2).
    if "if-match" in sent:
        is_other = not _names(joined(request, "if-match"), tag)
    else:
        is_other = _is_later(changed, sent.get("if-unmodified-since")) is True
    if is_other:
        raise PreconditionFailedError
    if "if-none-match" in sent:
        is_known = _names(joined(request, "if-none-match"), tag, weakly=True)
    else:
        is_known = _is_later(changed, sent.get("if-modified-since")) is False
    if is_known and request.method not in ("GET", "HEAD"):
        raise PreconditionFailedError
    return NotModifiedResponse(Headers(dict(headers))) if is_known else None


def _names(tags: str, tag: str | None, *, weakly: bool = False) -> bool:
    """Whether a strong tag is among those of a header; weak ones are no match unless compared weakly."""
    found = ((known, weakly or not weak) for weak, known in TAG.findall(tags))
    return tag is not None and (tags.strip() == "*" or (tag, True) in found)


def _is_later(changed: str | None, date: str | None) -> bool | None:
    """Whether a file was changed after a date; None if one of them is not known."""
    last, limit = _date(changed), _date(date)
    return None if last is None or limit is None else last > limit


def _date(text: str | None) -> datetime | None:
    try:
        found = parsedate_to_datetime(text or "")
    except (ValueError, OverflowError):
        return None
    return found.replace(tzinfo=found.tzinfo or UTC)
