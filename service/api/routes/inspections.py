"""Pixels of jobs, explained."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from schemas.inspections import Inspection, InspectionRequest
from service.analyses import inspections
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY, GONE, UNKNOWN
from service.api.routes.parameters import JobId, json_request, problem
from service.jobs.context import Here

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["pictures"])

EXAMPLE: dict[str, Any] = {"x": 0, "y": 0}


@router.post(
    "/inspections",
    responses=BODY
    | UNKNOWN
    | GONE
    | problem(422, "The request cannot be used, or the picture has no such pixel.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(InspectionRequest, EXAMPLE),
)
async def inspect(here: Here, job_id: JobId, body: JsonBody) -> Inspection:
    """Explain a pixel: what its ray has met, what each light adds there, what is in the way."""
    return await inspections.inspect(here, job_id, body)
