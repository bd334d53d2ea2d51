"""Authentication: the user of a request, before any route runs."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Annotated

from fastapi import Depends, Path, Request
from fastapi.concurrency import run_in_threadpool

from schemas.api.administration import Role
from service.access.hosts import check_host
from service.access.principals import LOCAL, Principal
from service.api.middleware import BY_PROXY
from service.errors import CrossSiteError, ForbiddenError, UnauthenticatedError
from service.jobs import lifecycle as jobs
from service.jobs.context import Here, Service
from service.settings import Settings

COOKIE = "penumbra_session"
USER_NAME = r"[!-~]([ -~]{0,62}[!-~])?"
"""The name of a user that a proxy may send, as a regular expression."""
SAFE = ("GET", "HEAD", "OPTIONS")


async def authenticate(request: Request, here: Here) -> Principal:
    """Return the user of a request, and note it for `claimant_of`.

    Raises
    ------
    UnauthenticatedError
        If a key is needed, and none or a wrong one was sent.
    KeyExpiredError
        If the key is expired.
    UnknownHostError
        If it was sent to another host name.
    CrossSiteError
        If a page of another site sent a request that changes something.
    """
    user = await _authenticated(request, here)
    request.state.user = user
    return user


async def _authenticated(request: Request, here: Service) -> Principal:
    key = bearer(request)
    if key is None:
        _check_origin(request)
    if here.settings.behind_proxy:
        check_host(request, here.settings, asks_for_keys=False)
        return _of_proxy(request, here.settings)
    asks_for_keys = await _keys_made(here)
    check_host(request, here.settings, asks_for_keys=asks_for_keys)
    if not asks_for_keys:
        return LOCAL
    found = await run_in_threadpool(_look_up, here, key, request.cookies.get(cookie_name(request)))
    if found is None:
        raise UnauthenticatedError(wrong=key is not None)
    return found


def cookie_name(request: Request) -> str:
    """Name the cookie of a session: over TLS so that no other host of the domain can set one like it."""
    return f"__Host-{COOKIE}" if request.url.scheme == "https" else COOKIE


def _of_proxy(request: Request, settings: Settings) -> Principal:
    """Return the user that the proxy names, or the common user.

    Raises
    ------
    ForbiddenError
        If it does not name a required user, or is not trusted.
    """
    role = settings.proxy_role or Role.SUBMIT
    if settings.proxy_user_header is None:
        return replace(LOCAL, role=role)
    if not request.scope[BY_PROXY]:
        raise ForbiddenError(
            "Only a trusted proxy may name the user. The service's operator lists their addresses in "
            "`trusted_proxies`."
        )
    names = request.headers.getlist(settings.proxy_user_header)
    if len(names) != 1 or not re.fullmatch(USER_NAME, names[0]):
        raise ForbiddenError(
            f"The proxy must name the user in one header {settings.proxy_user_header}: 1 to 64 printable "
            "ASCII characters."
        )
    return Principal(names[0], role)


async def _keys_made(service: Service) -> bool:
    known = service.credentials.cached_keys_made()
    return await run_in_threadpool(service.credentials.keys_made) if known is None else known


def bearer(request: Request) -> str | None:
    """Return the key in ``Authorization: Bearer``."""
    scheme, _, key = request.headers.get("authorization", "").partition(" ")
    return key.strip() if scheme.lower() == "bearer" else None


def _look_up(service: Service, key: str | None, token: str | None) -> Principal | None:
    if key is not None:
        return service.credentials.of_key(key)
    return service.credentials.of_session(token) if token else None


def _check_origin(request: Request) -> None:
    # Browsers add cookies to requests of any page, and let any page reach loopback, but they send its origin.
    if request.method in SAFE:
        return
    origin = request.headers.get("origin")
    foreign = origin is not None and origin.partition("://")[2] != request.headers.get("host")
    if foreign or request.headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        raise CrossSiteError


CurrentUser = Annotated[Principal, Depends(authenticate)]


async def _admin(user: CurrentUser) -> Principal:
    if not user.changes_all:
        raise ForbiddenError("Only an admin may do this.")
    return user


Admin = Annotated[Principal, Depends(_admin)]
"""A user who is an admin; 403 for all others."""


def claimant_of(request: Request) -> str:
    """Return the claimant of shared resources: the user, or the address if all are one user."""
    user: Principal = request.state.user
    return request.client.host if user.is_everyone and request.client else user.name


JOB_PATH = Path(max_length=64, description="The job's id.")


async def _seen(here: Here, user: CurrentUser, job_id: Annotated[str, JOB_PATH]) -> str:
    if not user.sees_all:
        await run_in_threadpool(_owner, here, job_id, user.name)
    return job_id


async def _changed(here: Here, user: CurrentUser, job_id: Annotated[str, JOB_PATH]) -> str:
    if not user.changes_all:
        owner = await run_in_threadpool(_owner, here, job_id, None if user.sees_all else user.name)
        if owner != user.name:
            raise ForbiddenError("Only the owner of a job, or an admin, can stop or delete it.")
    return job_id


def _owner(service: Service, job_id: str, asked_by: str | None) -> str:
    with service.database.reading() as session:
        return jobs.owner_of(session, job_id, asked_by)


JobId = Annotated[str, Depends(_seen)]
"""The id of a job that the user may see, and pin; 404 for all others."""

ChangedJob = Annotated[str, Depends(_changed)]
"""The id of a job that the user may stop and remove."""
