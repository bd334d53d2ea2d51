"""Rules of all routes: HEAD wherever there is GET, and only declared query parameters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, get_args, get_origin

from fastapi import APIRouter, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from schemas.errors import Problem
from schemas.reading.translation import nearest
from service.errors import ParametersError

Routers = Iterable[APIRouter]


def heads_of(router: APIRouter) -> APIRouter:
    """Make routes that answer HEAD as GET is answered; the server leaves out the body.

    A route with its own HEAD, which saves the work for a body, keeps it.
    """
    routes = _routes([router])
    own = {route.path for route in routes if "HEAD" in _methods(route)}
    heads = APIRouter(include_in_schema=False)
    for route in routes:
        if "GET" in _methods(route) and route.path not in own:
            heads.add_api_route(
                route.path,
                route.endpoint,
                methods=["HEAD"],
                response_class=route.response_class,
                response_model=route.response_model,
            )
    return heads


def allowed(routers: Routers, path: str) -> list[str]:
    """List the methods that routes answer at a path, in alphabetical order."""
    found = {
        method for route in _routes(routers) if route.path_regex.match(path) for method in _methods(route)
    }
    if "GET" in found:
        found.add("HEAD")
    return sorted(found)


def _methods(route: APIRoute) -> set[str]:
    return route.methods or set()


def _routes(routers: Routers) -> list[APIRoute]:
    return [route for router in routers for route in router.routes if isinstance(route, APIRoute)]


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
    """Return the query parameters of a route, and whether each may be repeated."""
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
        else "This is not a query parameter"
    )
    known = ", ".join(map(repr, names))
    return Problem(
        pointer="",
        detail=f"{what}: this address takes {known or 'none'}.",
        code="unknown_parameter",
        suggestion=nearest(name, names),
    )


def _repeated(name: str) -> Problem:
    detail = f"The query parameter {name!r} is repeated. Send it once."
    return Problem(pointer="", detail=detail, code="repeated_parameter")
