"""What became of jobs."""

from __future__ import annotations

from fastapi import APIRouter

from schemas.logs import JobLog
from service import job_logs
from service.context import Here
from service.routes.jobs import UNKNOWN
from service.routes.parameters import JobId

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])


@router.get("/log", responses=UNKNOWN)
def get_log(here: Here, job_id: JobId) -> JobLog:
    """Tell what became of a job so far: states, passes, repeated steps, workers lost, failures."""
    return job_logs.log_of(here, job_id)
