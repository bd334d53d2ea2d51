"""Text in results: sanitize untrusted text, and format numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def harmless(text: str) -> str:
    """Replace each non-printable character by a space, except line ends.

    Control characters are not allowed in XML, lone surrogates cannot be encoded, and characters that change
    the direction of writing can deceive a reader.

    >>> harmless("Zoë" + chr(27) + "[31m")
    'Zoë [31m'
    """
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def line(text: str) -> str:
    """Sanitize text and join it to one line."""
    return " ".join(harmless(text).split())


def shortened(text: str, most: int) -> str:
    """Cut text to `most` characters, with an ellipsis if it was longer.

    >>> shortened("columns 3 to 10", 8)
    'columns…'
    """
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"


def rounded(value: float, digits: int = 2) -> float:
    """Round a number for a document: sums of shares end in digits that say nothing.

    >>> rounded(0.1 + 0.2), rounded(2 / 3, 6)
    (0.3, 0.666667)
    """
    # Adding 0 turns -0.0 into 0.0.
    return round(value, digits) + 0.0


def significant(value: float) -> float:
    """Round a number to six significant digits.

    >>> significant(0.000123456789), significant(1234567.8)
    (0.000123457, 1234570.0)
    """
    return float(f"{value:.6g}")


def number(points: float) -> str:
    """Format points with as few decimals as possible, at most two.

    >>> number(12.5), number(90.0), number(1 / 3)
    ('12.5', '90', '0.33')
    """
    return f"{points:.2f}".rstrip("0").rstrip(".")


def encoded(document: Mapping[str, Any]) -> bytes:
    """Encode a JSON file as UTF-8 with a final newline; NaN and infinity raise ValueError."""
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
