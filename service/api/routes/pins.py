"""Pinned jobs, whose pictures are kept."""

from __future__ import annotations

from fastapi import APIRouter

from schemas.jobs import Job
from service.api.authentication import CurrentUser, KeptJob
from service.api.routes.jobs import GONE, UNKNOWN
from service.api.routes.parameters import problem
from service.jobs import pins
from service.jobs.context import Here

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])


@router.put(
    "/pin",
    responses=UNKNOWN | GONE | problem(403, "As many of your jobs are pinned as may be."),
)
def pin_job(here: Here, user: CurrentUser, job_id: KeptJob) -> Job:
    """Keep the picture of a job until it is unpinned or deleted. For its owner and staff."""
    return pins.pin(here, job_id, user)


@router.delete("/pin", responses=UNKNOWN)
def unpin_job(here: Here, job_id: KeptJob) -> Job:
    """Let the picture of a job go when its time has come."""
    return pins.unpin(here, job_id)
