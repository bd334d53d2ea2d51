"""Jobs: submit, look, list, cancel, remove."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from schemas.jobs import Job, JobList, JobRequest
from schemas.plans import PlanDocument
from service import jobs, submissions
from service.admission import admit
from service.bodies import json_body
from service.context import Here, Service
from service.routes.parameters import JobId, Prefer, json_request, preferred_wait, problem

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

UNKNOWN = problem(404, "There is no such job.")
GONE = problem(410, "The job ended without a picture, and what it was asked for is gone.")
BODY = problem(413, "The body is too large.") | problem(415, "The body is not JSON.")


@router.post(
    "",
    status_code=202,
    responses=BODY | problem(422, "The request cannot be used; every reason is listed."),
    openapi_extra=json_request(JobRequest),
)
async def submit(here: Here, request: Request, response: Response, prefer: Prefer = None) -> Job:
    """Submit a scene. The answer is the job; with `Prefer: wait=N` once it ends or N seconds have passed."""
    body = await json_body(request, here.settings.limits.max_body_bytes)
    job_id = await run_in_threadpool(_create, here, body)
    wait = preferred_wait(prefer, here.settings.max_wait_seconds)
    await jobs.until(here, job_id, wait, lambda standing: standing.state.final)
    job = await run_in_threadpool(jobs.show, here, job_id)
    response.headers["Location"] = job.links.self
    if wait:
        response.headers["Preference-Applied"] = f"wait={wait:g}"
    return job


def _create(service: Service, body: bytes) -> str:
    return submissions.create(service, admit(service, body), body)


@router.get("", responses=problem(422, "A parameter cannot be used."))
def list_jobs(
    here: Here,
    limit: Annotated[int, Query(ge=1, le=100, description="Jobs on a page.")] = 20,
    cursor: Annotated[
        int | None,
        Query(ge=1, le=2**31 - 1, description="`next` of the page before; the newest jobs without it."),
    ] = None,
) -> JobList:
    """List jobs, newest first."""
    return jobs.page(here, limit, cursor)


@router.get("/{job_id}", responses=UNKNOWN)
def get_job(here: Here, job_id: JobId) -> Job:
    """Look at a job."""
    return jobs.show(here, job_id)


@router.post("/{job_id}/cancel", responses=UNKNOWN)
async def cancel_job(here: Here, job_id: JobId) -> Job:
    """Stop a job. The answer comes when nothing of it runs any more; a job that has ended stays as it is."""
    return await jobs.stop(here, job_id)


@router.delete(
    "/{job_id}",
    status_code=204,
    responses=UNKNOWN | problem(503, "The job is still being stopped."),
)
async def delete_job(here: Here, job_id: JobId) -> None:
    """Stop a job if it runs, and remove it with everything it made."""
    await jobs.remove(here, job_id)


@router.get("/{job_id}/plan", responses=UNKNOWN)
def get_plan(here: Here, job_id: JobId) -> PlanDocument:
    """Show what runs for a job, and which lines of the scene asked for it."""
    return jobs.plan_of(here, job_id)
