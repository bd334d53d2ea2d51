"""What became of jobs."""

from __future__ import annotations

from fastapi import APIRouter

from schemas.logs import JobLog
from service.api.routes.jobs import UNKNOWN
from service.api.routes.parameters import JobId
from service.jobs import logs as job_logs
from service.jobs.context import Here

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])


@router.get("/log", responses=UNKNOWN)
def get_log(here: Here, job_id: JobId) -> JobLog:
    """Tell what became of a job so far: states, passes, repeated steps, workers lost, failures."""
    return job_logs.log_of(here, job_id)
