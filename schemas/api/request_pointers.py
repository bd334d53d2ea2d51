"""Conversion of JSON Pointers between a scene and the request that contains it.

The renderer's pointers begin at the scene. Over HTTP every pointer refers to the posted body, and to a value
that is present there. A client whose user has only a scene converts them back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel

from schemas.pointers import Parts, pointer, tokens

Answer = TypeVar("Answer", bound=BaseModel)

SCENE = "/scene"
_QUALITY = {"antialiasing", "light"}
"""Parts of a scene's sampling that the quality of a request overrides."""


def in_request(answer: Answer, request: BaseModel) -> Answer:
    """Make the pointers of an answer relative to its request.

    Parameters
    ----------
    answer
        Its pointers are relative to a scene, also those that begin a reason.
    request
        The request with its `scene`, and perhaps a `quality`. The pointer of a default becomes that of the
        nearest value around it that is present; lists omit it if that is the whole scene.
    """
    return _changed(answer, lambda place: _in_request(place, request))


def in_scene(answer: Answer) -> Answer:
    """Make the pointers of an answer over HTTP relative to the scene of its request."""
    return _changed(answer, lambda place: place.removeprefix(SCENE))


def _changed(answer: Answer, change: Callable[[str], str | None]) -> Answer:
    return type(answer).model_validate(_walked(answer.model_dump(), change))


def _walked(node: Any, change: Callable[[str], str | None]) -> Any:
    if isinstance(node, Mapping):
        return {name: _field(name, value, change) for name, value in node.items()}
    if isinstance(node, list | tuple):
        return [_walked(value, change) for value in node]
    return node


def _field(name: str, value: Any, change: Callable[[str], str | None]) -> Any:
    match name:
        case "pointers":
            return list(dict.fromkeys(filter(None, map(change, value))))
        case "pointer":
            return change(value) or SCENE
        case "reason" if value.startswith("/"):
            place, space, rest = value.partition(" ")
            return f"{change(place) or SCENE}{space}{rest}"
        case _:
            return _walked(value, change)


def _in_request(place: str, request: BaseModel) -> str | None:
    """Give the pointer of a value of the scene; None if it is not present."""
    parts = tokens(place)
    if parts[:1] == ("sampling",) and _QUALITY.intersection(parts[1:2]):
        replaced = ("quality", *parts[1:])
        if _written(request, replaced)[:2] == replaced[:2]:
            return pointer(_written(request, replaced))
    found = _written(request, ("scene", *parts))
    return pointer(found) if len(found) > 1 or not parts else None


def _written(node: Any, parts: Parts) -> Parts:
    """Shorten a location to its longest prefix that is present."""
    for depth, part in enumerate(parts):
        if isinstance(node, BaseModel) and part in node.model_fields_set:
            node = getattr(node, str(part))
        elif isinstance(node, Mapping) and part in node:
            node = node[part]
        elif isinstance(node, Sequence) and not isinstance(node, str) and str(part).isdecimal():
            node = node[int(part)]
        else:
            return parts[:depth]
    return parts
