"""Numbers for those who watch the service."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST

from service.context import Here

router = APIRouter(tags=["operations"])


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
def metrics(here: Here) -> Response:
    """Tell what Prometheus asks: queue, tiles, retries, failures, CPU seconds, errors."""
    return Response(here.dispatcher.metrics.text(here.database), media_type=CONTENT_TYPE_LATEST)
