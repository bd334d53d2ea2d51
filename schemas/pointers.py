"""JSON Pointers (RFC 6901), kept as tuples of keys and indices until they are shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

Parts = tuple[str | int, ...]

LONGEST_KEY = 200
"""A longer key is not repeated in a pointer: the pointer ends at the object that has it."""


def pointer(parts: Iterable[str | int]) -> str:
    """Write a pointer.

    >>> pointer(["materials", "a/b", "color", 0])
    '/materials/a~1b/color/0'
    """
    return "".join("/" + escaped(str(part)) for part in parts)


def escaped(name: str) -> str:
    """Write a name as one token of a pointer."""
    return name.replace("~", "~0").replace("/", "~1")


def tokens(pointer: str) -> tuple[str, ...]:
    """Read the names and numbers in a pointer.

    >>> tokens("/materials/a~1b/color/0")
    ('materials', 'a/b', 'color', '0')
    """
    return tuple(part.replace("~1", "/").replace("~0", "~") for part in pointer.split("/")[1:])


def existing(document: object, parts: Iterable[str | int]) -> Parts:
    """Shorten a location to its longest beginning that the document really has.

    So a missing field becomes the object that lacks it, and a default the object that could set it.
    """
    found: list[str | int] = []
    for part in parts:
        if not _has(document, part):
            break
        if isinstance(part, str) and len(part) > LONGEST_KEY:
            break
        document = value_at(document, (part,))
        found.append(part)
    return tuple(found)


def value_at(document: object, parts: Iterable[str | int]) -> object:
    """Give the value at an existing location of a document."""
    for part in parts:
        document = document[part]  # type: ignore[index]  # `existing` has walked it
    return document


def _has(document: object, part: str | int) -> bool:
    if isinstance(document, Mapping):
        return isinstance(part, str) and part in document
    return isinstance(document, list | tuple) and isinstance(part, int) and part < len(document)
