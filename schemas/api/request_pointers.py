"""Pointers of answers: the renderer's begin at the scene, those over HTTP at the request that has the scene.

Over HTTP every pointer leads into the body that was posted, as those of problems and warnings do, and to
something that is written there. A client whose user has a scene, and no request, turns them back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel

from schemas.pointers import Parts, pointer, tokens

Answer = TypeVar("Answer", bound=BaseModel)

SCENE = "/scene"
_QUALITY = {"antialiasing", "light"}
"""Parts of a scene's sampling that the quality of a request can take the place of."""


def in_request(answer: Answer, request: BaseModel) -> Answer:
    """Let the pointers of an answer lead into its request.

    Parameters
    ----------
    answer
        Its pointers lead into a scene, and where a sentence begins with one it does, too.
    request
        The request as it was read: it has a `scene`, and may have a `quality`. A pointer to a
        default leads to the nearest written value around it; lists of pointers leave it out where that is
        the whole scene.
    """
    return _changed(answer, lambda place: _in_request(place, request))


def in_scene(answer: Answer) -> Answer:
    """Let the pointers of an answer over HTTP lead into the scene of its request."""
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
    """Give the pointer of a place of the scene; None where nothing there is written."""
    parts = tokens(place)
    if parts[:1] == ("sampling",) and _QUALITY.intersection(parts[1:2]):
        replaced = ("quality", *parts[1:])
        if _written(request, replaced)[:2] == replaced[:2]:
            return pointer(_written(request, replaced))
    found = _written(request, ("scene", *parts))
    return pointer(found) if len(found) > 1 or not parts else None


def _written(node: Any, parts: Parts) -> Parts:
    """Shorten a location to the longest beginning that the user has written."""
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
