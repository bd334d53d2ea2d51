"""Methods of addresses: HEAD wherever GET is, and the list of those that an address answers."""

from __future__ import annotations

from collections.abc import Iterable

from fastapi import APIRouter
from fastapi.routing import APIRoute

Routers = Iterable[APIRouter]


def heads_of(router: APIRouter) -> APIRouter:
    """Make routes that answer HEAD as GET is answered; the server leaves out the body.

    An address that answers HEAD in its own way, to save the work for a body, keeps it.
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
    """List the methods that routes answer at a path, in alphabetical order; none where there is none."""
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
