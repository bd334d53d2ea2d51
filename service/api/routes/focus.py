"""Which part of a picture is rendered first."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response
from fastapi.concurrency import run_in_threadpool

from schemas.regions import Region
from service.api.authentication import ChangedJob
from service.api.bodies import JsonBody
from service.api.routes.jobs import BODY, GONE, NOT_YOURS, UNKNOWN
from service.api.routes.parameters import json_request, problem
from service.jobs.context import Here
from service.jobs.focus import focus

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])

EXAMPLE: dict[str, Any] = {"x0": 0, "y0": 0, "x1": 64, "y1": 64}


@router.post(
    "/focus",
    status_code=204,
    response_class=Response,
    responses=BODY | UNKNOWN | NOT_YOURS | GONE | problem(422, "The rectangle cannot be used."),
    openapi_extra=json_request(Region, EXAMPLE),
)
async def set_focus(here: Here, job_id: ChangedJob, body: JsonBody) -> None:
    """Have a rectangle of the picture rendered before the rest of each pass."""
    await run_in_threadpool(focus, here, job_id, body)
