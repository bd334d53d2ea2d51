"""Which form of an answer an Accept header asks for (RFC 9110, section 12.5.1)."""

from __future__ import annotations

from collections.abc import Sequence


def liked_best(accept: str, offered: Sequence[str]) -> str:
    """Choose one of the media types that are offered; the first of them where none is liked.

    Each type has the weight of the range that fits it most closely. Of types that are liked alike the one is
    chosen whose range comes first.

    >>> forms = ("application/json", "text/csv")
    >>> [
    ...     liked_best(accept, forms)
    ...     for accept in ("text/*;q=0.5", "*/*", "application/json;q=0, */*", "image/png")
    ... ]
    ['text/csv', 'application/json', 'text/csv', 'application/json']
    """
    ranges = [_range(part) for part in accept.split(",")]
    weighed = [(_weight(media_type, ranges), media_type) for media_type in offered]
    (weight, _), best = max(weighed, key=lambda found: found[0])
    return best if weight > 0 else offered[0]


def _weight(media_type: str, ranges: Sequence[tuple[str, float]]) -> tuple[float, int]:
    """Give the weight of a type, and as a negative number the place of the range that says so."""
    for pattern in (media_type, f"{media_type.partition('/')[0]}/*", "*/*"):
        for place, (found, weight) in enumerate(ranges):
            if found == pattern:
                return weight, -place
    return 0.0, 0


def _range(part: str) -> tuple[str, float]:
    pattern, *parameters = (word.strip().lower() for word in part.split(";"))
    weights = [word.removeprefix("q=") for word in parameters if word.startswith("q=")]
    try:
        return pattern, float(weights[0]) if weights else 1.0
    except ValueError:
        return pattern, 0.0
