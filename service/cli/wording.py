"""Sentences of pydantic, which checks options and settings, in plain words; numbers with their nouns."""

from __future__ import annotations

import re

_PLAIN = (
    (re.compile(r"Input should be a valid integer\b.*"), "It must be a whole number"),
    (re.compile(r"Input should be a valid number\b.*"), "It must be a number"),
    (re.compile(r"Input should be a valid boolean\b.*"), "It must be true or false"),
    (re.compile(r"Input should be greater than or equal to\b"), "It must be at least"),
    (re.compile(r"Input should be less than or equal to\b"), "It must be at most"),
    (re.compile(r"Input should be greater than\b"), "It must be more than"),
    (re.compile(r"Input should be\b"), "It must be"),
    (re.compile(r"Value error, "), ""),
)
"""Pydantic's messages and their replacements; the first match counts."""


def plain(message: str) -> str:
    """Write a message of pydantic plainly, as a sentence.

    >>> plain("Input should be a valid integer, unable to parse string as an integer")
    'It must be a whole number.'
    >>> plain("Invalid value for '--port': Input should be less than or equal to 65535")
    "Invalid value for '--port': It must be at most 65535."
    """
    for pattern, instead in _PLAIN:
        if pattern.search(message):
            message = pattern.sub(instead, message)
            break
    return message if message.endswith((".", ")", "?")) else f"{message}."


def counted(number: int, noun: str) -> str:
    """A number with its noun.

    >>> counted(1, "worker"), counted(0, "tile"), counted(1234, "pixel")
    ('1 worker', '0 tiles', '1,234 pixels')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
