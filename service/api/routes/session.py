"""Browser sessions: a key is sent once, and a cookie replaces it afterwards."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from schemas.api.administration import WhoAmI
from service.access import keys
from service.access.keys import Key, read_key
from service.api.authentication import CurrentUser, bearer, cookie_name
from service.api.routes.parameters import problem
from service.jobs.context import Here, Service

router = APIRouter(prefix="/v1/session", tags=["access"])

REFUSED = (
    problem(
        401,
        "A key is needed, and none, a wrong or an expired one was sent.",
        "unauthenticated",
        "key_expired",
    )
    | problem(403, "A page of another site sent the request.", "cross_site")
    | problem(421, "The request was sent to a host name that is not one of the service.", "unknown_host")
)


@router.post(
    "",
    responses=REFUSED,
    summary="Begin a session",
    response_description="The user. `Set-Cookie` has the cookie.",
)
async def begin_session(here: Here, request: Request, response: Response, user: CurrentUser) -> WhoAmI:
    """Begin a session with the key in `Authorization: Bearer`.

    The response sets a cookie that replaces the key. Scripts cannot read the cookie, and browsers send it
    only from pages of this service.
    """
    key = read_key(bearer(request) or "")
    if key is not None and not here.settings.behind_proxy and not user.is_everyone:
        token = await here.write(_begin, here, key)
        response.set_cookie(
            cookie_name(request),
            token,
            max_age=int(keys.SESSION_LIFE.total_seconds()),
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )
    return _who(here, user)


@router.get("", responses=REFUSED, summary="Get the current user", response_description="The user.")
async def who_am_i(here: Here, user: CurrentUser) -> WhoAmI:
    """Get the user that a key or a cookie belongs to, and their role."""
    return _who(here, user)


@router.delete(
    "",
    status_code=204,
    response_class=Response,
    responses=REFUSED,
    summary="End the session",
    response_description="The cookie is deleted and no longer valid.",
)
async def end_session(here: Here, request: Request, response: Response, user: CurrentUser) -> None:  # noqa: ARG001
    """End the session of the cookie that comes with the request."""
    token = request.cookies.get(cookie_name(request))
    if token:
        await here.write(_end, here, token)
    # Browsers ignore a cookie of this name that is not Secure, be it to delete it.
    secure = request.url.scheme == "https"
    response.delete_cookie(cookie_name(request), secure=secure, httponly=True, samesite="strict")


def _who(service: Service, user: CurrentUser) -> WhoAmI:
    required = not service.settings.behind_proxy and service.credentials.keys_made()
    return WhoAmI(user=user.name, role=user.role, keys_required=required)


def _begin(service: Service, key: Key) -> str:
    with service.database.writing() as session:
        return keys.begin_session(session, key)


def _end(service: Service, token: str) -> None:
    with service.database.writing() as session:
        keys.end_session(session, token)
    service.credentials.clear()
