"""Compression of files that everybody gets. Answers with secrets are not: their length could betray them."""

from __future__ import annotations

import gzip
import re
from functools import lru_cache

COMPRESSIBLE = ("text/", "application/json", "image/svg+xml")
"""Beginnings of media types whose files become smaller; pictures are compressed already."""
FEWEST_BYTES = 1000
"""Smaller files fit in one packet with or without compression."""

_REFUSED = re.compile(r"q=0(?:\.0*)?")


@lru_cache(maxsize=512)
def gzipped(content: bytes) -> bytes:
    """Compress some content; files of the page are compressed once, not for each visitor."""
    return gzip.compress(content, mtime=0)


def is_compressible(content: bytes, media_type: str) -> bool:
    """Whether compressing some content saves anything."""
    return len(content) >= FEWEST_BYTES and media_type.startswith(COMPRESSIBLE)


def accepts_gzip(header: str) -> bool:
    """Whether an Accept-Encoding header allows gzip (RFC 9110, section 12.5.3).

    >>> [accepts_gzip(header) for header in ("br, gzip", "*", "GZIP;q=0.5", "", "br", "gzip;q=0, *")]
    [True, True, True, False, False, False]
    """
    found: dict[str, list[str]] = {}
    for part in header.lower().split(","):
        name, *parameters = (piece.strip() for piece in part.split(";"))
        found[name] = parameters
    named = found.get("gzip", found.get("*"))
    return named is not None and not any(map(_REFUSED.fullmatch, named))
