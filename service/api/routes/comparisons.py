"""What is seen in pictures: comparisons of two, and pixels of jobs explained."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from schemas.comparisons import ComparisonAnswer, ComparisonRequest
from schemas.inspections import Inspection, InspectionRequest
from service.analyses import comparisons, inspections
from service.api.authentication import CurrentUser
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY, GONE, UNKNOWN
from service.api.routes.parameters import JobId, json_request, problem
from service.jobs.context import Here

router = APIRouter(prefix="/v1", tags=["pictures"])

# One white pixel as a PNG file.
WHITE = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC"
PICTURES: dict[str, Any] = {"image": {"content": WHITE}, "reference": {"content": WHITE, "encoding": "srgb"}}


@router.post(
    "/comparisons",
    responses=BODY
    | problem(422, "The request, or one of its pictures, cannot be used; every reason is listed.")
    | problem(429, "As many comparisons as the service makes at once are being made.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(ComparisonRequest, PICTURES),
)
async def compare(here: Here, user: CurrentUser, body: JsonBody) -> ComparisonAnswer:
    """Compare two pictures, sent or of jobs: metrics, a verdict that knows noise, the mistake behind it."""
    return await comparisons.compare(here, user, body)


PIXEL: dict[str, Any] = {"x": 0, "y": 0}


@router.post(
    "/jobs/{job_id}/inspections",
    responses=BODY
    | UNKNOWN
    | GONE
    | problem(422, "The request cannot be used, or the picture has no such pixel.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(InspectionRequest, PIXEL),
)
async def inspect(here: Here, job_id: JobId, body: JsonBody) -> Inspection:
    """Explain a pixel: what its ray has met, what each light adds there, what is in the way."""
    return await inspections.inspect(here, job_id, body)
