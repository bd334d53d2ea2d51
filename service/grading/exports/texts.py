"""Words in results: what strangers wrote made harmless, and numbers as people write them."""

from __future__ import annotations


def harmless(text: str) -> str:
    """What somebody wrote, with a blank for each character that is not printed; line ends stay.

    Control characters, half of a pair of surrogates, and characters that turn the direction of writing are
    not allowed in XML, not to be encoded, or made to deceive.

    >>> harmless("Zoë" + chr(27) + "[31m")
    'Zoë [31m'
    """
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def line(text: str) -> str:
    """The same on one line."""
    return " ".join(harmless(text).split())


def shortened(text: str, most: int) -> str:
    """At most so many characters, with an ellipsis where something was cut.

    >>> shortened("columns 3 to 10", 8)
    'columns…'
    """
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"


def number(points: float) -> str:
    """Points with as many decimals as they need, two at most.

    >>> number(12.5), number(90.0), number(1 / 3)
    ('12.5', '90', '0.33')
    """
    return f"{points:.2f}".rstrip("0").rstrip(".")
