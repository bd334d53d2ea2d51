"""Numbers for those who watch the service."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST

from service.api.authentication import CurrentUser
from service.errors import ForbiddenError
from service.jobs.context import Here

router = APIRouter(tags=["operations"])


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
def metrics(here: Here, user: CurrentUser) -> Response:
    """Tell what Prometheus asks: queue, tiles, deaths, failures, CPU seconds, errors."""
    if not user.sees_all:
        raise ForbiddenError("The numbers name all users: staff and admins alone may see them.")
    return Response(here.dispatcher.metrics.text(here.database), media_type=CONTENT_TYPE_LATEST)
