"""What jobs were asked for."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response

from schemas.jobs import JobRequest
from service.api.routes.jobs import UNKNOWN
from service.api.routes.parameters import JobId
from service.jobs.context import Here
from service.jobs.requests import request_of

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])


@router.get("/request", response_model=JobRequest, responses=UNKNOWN)
def get_request(here: Here, job_id: JobId) -> Response:
    """Return the body that the job was submitted with, byte for byte: its lines are those of the sender."""
    return Response(request_of(here, job_id), media_type="application/json")
