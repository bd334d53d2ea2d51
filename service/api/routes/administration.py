"""For those who run the service: its numbers, and deleting what it keeps."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST

from schemas.reading import read_document
from schemas.retention import Pruned, PruneRequest
from service.api.authentication import CurrentUser
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY
from service.api.routes.parameters import json_request, problem
from service.errors import ForbiddenError
from service.jobs.context import Here, Service
from service.jobs.retention import Rules

router = APIRouter(tags=["operations"])


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
def metrics(here: Here, user: CurrentUser) -> Response:
    """Give Prometheus its numbers: queue, tiles, deaths, failures, CPU seconds, errors."""
    if not user.sees_all:
        raise ForbiddenError("The numbers name all users: staff and admins alone may see them.")
    return Response(here.dispatcher.metrics.text(here.database), media_type=CONTENT_TYPE_LATEST)


DRY_RUN: dict[str, Any] = {"max_stored_bytes": 10_000_000_000, "dry_run": True}


@router.post(
    "/v1/prune",
    responses=BODY | problem(403, "For admins alone.") | problem(422, "The request cannot be used."),
    openapi_extra=json_request(PruneRequest, DRY_RUN),
)
async def prune(here: Here, user: CurrentUser, body: JsonBody) -> Pruned:
    """Delete now what the rules do not keep, or only report what that would be. Pinned jobs stay."""
    if not user.changes_all:
        raise ForbiddenError("Only an admin removes what is kept for others.")
    asked, _ = read_document(body, PruneRequest)
    return await run_in_threadpool(_prune, here, asked)


def _prune(service: Service, asked: PruneRequest) -> Pruned:
    usual, retention_thread = service.retention_thread.rules, service.retention_thread
    rules = Rules(
        usual.keep_seconds if asked.keep_seconds is None else asked.keep_seconds,
        usual.max_stored_bytes if asked.max_stored_bytes is None else asked.max_stored_bytes,
        usual.keep_asset_seconds if asked.keep_asset_seconds is None else asked.keep_asset_seconds,
    )
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
