"""Positions in a JSON text of the values that pointers name.

Positions are looked for only when there is something to say about them. The text has been parsed before, so
it is JSON, and no deeper than the limit on nesting allows.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from schemas.pointers import Parts

_SPACE = re.compile(r"[ \t\n\r]*")
# Values in between are passed over by the C parser; numbers of any length must not stop it.
_PASS_OVER = json.JSONDecoder(parse_int=len, parse_float=len)


@dataclass(slots=True)
class Place:
    """Position of one value of a document, as offsets into its text.

    `keys` has the starts of its keys, several where a key is repeated, none in an array.
    """

    value: int = 0
    keys: list[int] = field(default_factory=list)


@dataclass(slots=True)
class _Wanted:
    place: Place = field(default_factory=Place)
    inner: dict[str, _Wanted] = field(default_factory=dict)

    def at(self, part: str | int) -> _Wanted:
        return self.inner.setdefault(str(part), _Wanted())


def locate(text: str, locations: Iterable[Parts]) -> dict[Parts, Place]:
    """Find the places of several locations in one walk.

    Parameters
    ----------
    text
        JSON.
    locations
        Locations that the document has.

    Returns
    -------
    dict
        A place for each location. Of repeated keys the last one's value counts, as it does in reading.
    """
    root = _Wanted()
    positions = {}
    for parts in locations:
        wanted = root
        for part in parts:
            wanted = wanted.at(part)
        positions[parts] = wanted.place
    _walk(text, _skip(text, 0), root)
    return positions


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    r"""Turn an offset into a line and a column, both from 1, counted in characters.

    >>> line_and_column("ab\r\ncd", 5)
    (2, 2)
    """
    return text.count("\n", 0, offset) + 1, offset - text.rfind("\n", 0, offset)


Find = Callable[[str, Iterable[Parts]], dict[Parts, Place]]
"""Finds the places of locations in a text, as `locate` does in JSON."""


def _skip(text: str, offset: int) -> int:
    match = _SPACE.match(text, offset)
    return match.end() if match else offset


def _walk(text: str, start: int, wanted: _Wanted) -> int:
    """Record the start of a value and search inside it; return its end."""
    wanted.place.value = start
    if wanted.inner and text[start] == "{":
        return _walk_object(text, start, wanted)
    if wanted.inner and text[start] == "[":
        return _walk_array(text, start, wanted)
    return _end(text, start)


def _end(text: str, start: int) -> int:
    return _PASS_OVER.raw_decode(text, start)[1]


def _walk_object(text: str, start: int, wanted: _Wanted) -> int:
    offset = _skip(text, start + 1)
    while text[offset] != "}":
        key, after = _PASS_OVER.raw_decode(text, offset)
        value = _skip(text, _skip(text, after) + 1)
        inner = wanted.inner.get(key)
        if inner is None:
            after = _end(text, value)
        else:
            inner.place.keys.append(offset)
            after = _walk(text, value, inner)
        offset = _next(text, after)
    return offset + 1


def _walk_array(text: str, start: int, wanted: _Wanted) -> int:
    offset = _skip(text, start + 1)
    index = 0
    while text[offset] != "]":
        inner = wanted.inner.get(str(index))
        offset = _next(text, _end(text, offset) if inner is None else _walk(text, offset, inner))
        index += 1
    return offset + 1


def _next(text: str, after: int) -> int:
    offset = _skip(text, after)
    return _skip(text, offset + 1) if text[offset] == "," else offset
