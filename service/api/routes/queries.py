"""Query parameters that a route does not have: refused, for whoever sends them expects them to count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, get_args, get_origin

from fastapi import Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from schemas.problems import Problem
from schemas.translation import nearest
from service.errors import ParametersError

# A longer name is not repeated in the answer.
LONGEST_NAME = 64


async def check_query(request: Request) -> None:
    """Refuse parameters that the route does not have, and several of one that counts once.

    Raises
    ------
    ParametersError
        Names each of them, and what was probably meant.
    """
    if not request.query_params:
        return
    route = request.scope["route"]
    assert isinstance(route, APIRoute)
    takes_several = dict(_parameters(route.dependant))
    sent = Counter(name for name, _ in request.query_params.multi_items())
    problems = [_unknown(name, list(takes_several)) for name in sent if name not in takes_several]
    problems += [
        _repeated(name) for name, times in sent.items() if times > 1 and not takes_several.get(name, True)
    ]
    if problems:
        raise ParametersError(problems)


def _parameters(dependant: Dependant) -> Iterator[tuple[str, bool]]:
    """Give the query parameters of a route, and whether each may be sent several times."""
    for parameter in dependant.query_params:
        yield parameter.alias, _is_list(parameter.field_info.annotation)
    for inner in dependant.dependencies:
        yield from _parameters(inner)


def _is_list(annotation: Any) -> bool:
    return any(get_origin(part) is list for part in (annotation, *get_args(annotation)))


def _unknown(name: str, names: list[str]) -> Problem:
    what = (
        f"There is no query parameter {name!r} here"
        if len(name) <= LONGEST_NAME
        else "This is no query parameter"
    )
    known = ", ".join(map(repr, names))
    return Problem(
        pointer="",
        detail=f"{what}: this address takes {known or 'none'}.",
        code="unknown_parameter",
        suggestion=nearest(name, names),
    )


def _repeated(name: str) -> Problem:
    detail = f"The query parameter {name!r} stands there more than once. Send one of them."
    return Problem(pointer="", detail=detail, code="repeated_parameter")
