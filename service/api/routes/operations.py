"""Routes for operators: health checks and version, which need no key, metrics, and pruning."""

from __future__ import annotations

import os
import shutil
import socket
from importlib.metadata import version as installed
from typing import Annotated, Any

from anyio import to_thread
from fastapi import APIRouter, Query
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel, Field
from sqlalchemy.exc import SQLAlchemyError

from schemas.api.administration import Pruned, PruneRequest, UserList, WorkerList
from schemas.api.jobs import Version
from schemas.reading import read_document
from service.api.authentication import Admin, CurrentUser
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY
from service.api.routes.parameters import json_request, problem
from service.errors import ForbiddenError, StoreError, UnavailableError
from service.jobs import usage
from service.jobs.context import Here, Service
from service.jobs.sweep import Rules

router = APIRouter(tags=["operations"])
"""Routes without authentication."""
staff_router = APIRouter(tags=["operations"])


class Condition(BaseModel):
    """The answer of a health check that passes."""

    status: str = Field(default="ok", description="Always `ok`; a check that fails is answered 503.")


@router.get(
    "/livez",
    responses=problem(503, "Restart the service.", "unavailable"),
    summary="Check that the process works",
    response_description="It works.",
)
async def livez(here: Here) -> Condition:
    """Check that the process works. If not, restart it."""
    # On the event loop, because all threads may be waiting for an unreachable database.
    if not here.dispatcher.lives():
        raise UnavailableError("The service no longer hands out work. Restart it.")
    return Condition()


@router.get(
    "/readyz",
    responses=problem(503, "`detail` says what is missing.", "unavailable"),
    summary="Check that jobs can run",
    response_description="They can.",
)
async def readyz(here: Here) -> Condition:
    """Check that the service can accept and render jobs now: its database, workers, disk and data folder."""
    checks = await to_thread.run_sync(_checks, here, limiter=here.probes)
    missing = [what for what, passes in checks.items() if not passes]
    if missing:
        raise UnavailableError(f"Not ready: {', '.join(missing)}.")
    return Condition()


def _checks(service: Service) -> dict[str, bool]:
    return {
        "the service is being stopped": not service.job_events.closed,
        "the database cannot be written": _database_writable(service),
        "no worker is running": service.dispatcher.alive(),
        "jobs cannot be handed out": not service.dispatcher.is_failing(),
        "expired files cannot be deleted": not service.retention_thread.is_failing(),
        "the disk is nearly full": _disk_free(service),
        _where(service): _store_usable(service),
    }


def _database_writable(service: Service) -> bool:
    try:
        service.database.check()
    except SQLAlchemyError:
        return False
    return True


def _where(service: Service) -> str:
    return (
        "the object store cannot be used" if service.settings.store else "the data folder cannot be written"
    )


def _store_usable(service: Service) -> bool:
    try:
        service.store.check()
    except (StoreError, OSError):
        return False
    return True


def _disk_free(service: Service) -> bool:
    try:
        return shutil.disk_usage(service.settings.data).free >= service.settings.min_free_bytes
    except OSError:
        return False


@router.get("/version", summary="Get the version", response_description="The version.")
def version() -> Version:
    """Get the version of the service and of its API."""
    return Version(version=installed("penumbra-render"))


METRICS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The metrics, in the text format of Prometheus.",
        "content": {"text/plain": {"schema": {"type": "string"}}},
    }
}


@staff_router.get(
    "/metrics",
    response_class=Response,
    responses=METRICS | problem(403, "Only staff and admins may see the metrics.", "forbidden"),
    summary="Get metrics",
)
def metrics(here: Here, user: CurrentUser) -> Response:
    """Get metrics for Prometheus: queue, tiles, lost workers, failures, CPU seconds, errors."""
    if not user.sees_all:
        raise ForbiddenError("The metrics name all users, so only staff and admins may see them.")
    return Response(here.dispatcher.metrics.text(here.database), media_type=CONTENT_TYPE_LATEST)


@staff_router.get(
    "/v1/users",
    responses=problem(403, "Only an admin may do this.", "forbidden"),
    summary="List users",
    response_description="One page of users, in the order of their names.",
)
def list_users(
    here: Here,
    user: Admin,  # noqa: ARG001  (checked)
    limit: Annotated[int, Query(ge=1, le=1000, description="Users on a page.")] = 100,
    cursor: Annotated[str | None, Query(max_length=64, description="`next` of the previous page.")] = None,
) -> UserList:
    """List the users of the service and what each uses of it."""
    with here.database.reading() as session:
        found = usage.page(session, limit + 1, cursor)
    return UserList(users=tuple(found[:limit]), next=found[limit - 1].user if len(found) > limit else None)


@staff_router.get(
    "/v1/workers",
    responses=problem(403, "Only an admin may do this.", "forbidden"),
    summary="List workers",
    response_description="The workers of the server that answers.",
)
def list_workers(here: Here, user: Admin) -> WorkerList:  # noqa: ARG001  (checked)
    """List the workers of this server, with task, user and duration.

    Of several servers on one database each has its own, and one hands out jobs.
    """
    with here.database.reading() as session:
        workers = usage.at_work(session, here.engine.workers())
    return WorkerList(server=f"{socket.gethostname()}:{os.getpid()}", workers=workers)


DRY_RUN: dict[str, Any] = {"max_stored_bytes": 10_000_000_000, "dry_run": True}


@staff_router.post(
    "/v1/prune",
    responses=BODY
    | problem(403, "Only admins may do this.", "forbidden")
    | problem(422, "The request cannot be used; `errors` lists every reason.", "scene_not_usable"),
    openapi_extra=json_request(PruneRequest, DRY_RUN),
    summary="Prune",
    response_description="What was deleted, or would be.",
)
async def prune(here: Here, user: Admin, body: JsonBody) -> Pruned:  # noqa: ARG001  (checked)
    """Delete expired pictures, jobs and assets by these rules, or with `dry_run` only list them.

    Rules that are not given come from the settings of the service. Pinned jobs stay.
    """
    asked, _ = read_document(body, PruneRequest)
    return await run_in_threadpool(_prune, here, asked)


def _prune(service: Service, asked: PruneRequest) -> Pruned:
    usual, retention_thread = service.retention_thread.rules, service.retention_thread
    rules = Rules(
        usual.keep_seconds if asked.keep_seconds is None else asked.keep_seconds,
        usual.max_stored_bytes if asked.max_stored_bytes is None else asked.max_stored_bytes,
        usual.keep_asset_seconds if asked.keep_asset_seconds is None else asked.keep_asset_seconds,
    )
    with service.reserve.given_up():
        swept = retention_thread.predict(rules) if asked.dry_run else retention_thread.prune(rules)
    return Pruned(
        dry_run=asked.dry_run,
        expired=tuple(swept.expired),
        forgotten=tuple(swept.forgotten),
        pictures=len(swept.pictures),
        assets=tuple(swept.assets),
        bytes=swept.bytes,
        more=swept.more,
    )
