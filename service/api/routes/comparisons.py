"""Comparisons: whether two pictures show the same."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from schemas.comparisons import ComparisonAnswer, ComparisonRequest
from service.analyses import comparisons
from service.api.authentication import CurrentUser
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY
from service.api.routes.parameters import json_request, problem
from service.jobs.context import Here

router = APIRouter(prefix="/v1", tags=["pictures"])

# One white pixel as a PNG file.
WHITE = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC"
EXAMPLE: dict[str, Any] = {"image": {"content": WHITE}, "reference": {"content": WHITE, "encoding": "srgb"}}


@router.post(
    "/comparisons",
    responses=BODY
    | problem(422, "The request, or one of its pictures, cannot be used; every reason is listed.")
    | problem(429, "As many comparisons as the service makes at once are being made.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(ComparisonRequest, EXAMPLE),
)
async def compare(here: Here, user: CurrentUser, body: JsonBody) -> ComparisonAnswer:
    """Compare two pictures, sent or of jobs: metrics, a verdict that knows noise, the mistake behind it."""
    return await comparisons.compare(here, user, body)
