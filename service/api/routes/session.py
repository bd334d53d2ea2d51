"""Browser sessions: a key is sent once, and a cookie replaces it afterwards."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from schemas.api.administration import WhoAmI
from service.access import keys
from service.access.keys import Key, read_key
from service.access.principals import LOCAL
from service.api.authentication import COOKIE, CurrentUser, bearer
from service.api.routes.parameters import problem
from service.jobs.context import Here, Service

router = APIRouter(prefix="/v1/session", tags=["access"])

REFUSED = (
    problem(401, "There is no key, or it is not valid.")
    | problem(403, "A page of another site sent this.")
    | problem(421, "This was sent to another host name.")
)


@router.post("", responses=REFUSED)
async def begin_session(here: Here, request: Request, response: Response, user: CurrentUser) -> WhoAmI:
    """Begin a session with the key in `Authorization: Bearer`: the answer sets a cookie that replaces it.

    The cookie is not shown to scripts, and browsers send it from pages of this service alone.
    """
    key = read_key(bearer(request) or "")
    if key is not None and user is not LOCAL:
        token = await run_in_threadpool(_begin, here, key)
        response.set_cookie(
            COOKIE,
            token,
            max_age=int(keys.SESSION_LIFE.total_seconds()),
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )
    return _who(here, user)


@router.get("", responses=REFUSED)
async def who_am_i(here: Here, user: CurrentUser) -> WhoAmI:
    """Show the user of this session."""
    return _who(here, user)


@router.delete("", status_code=204, response_class=Response, responses=REFUSED)
async def end_session(here: Here, request: Request, response: Response, user: CurrentUser) -> None:  # noqa: ARG001
    """End this session."""
    token = request.cookies.get(COOKIE)
    if token:
        await run_in_threadpool(_end, here, token)
    response.delete_cookie(COOKIE, httponly=True, samesite="strict")


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
