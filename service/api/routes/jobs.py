"""Jobs: submit, show, list, cancel, pause, pin, delete."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from schemas.api.jobs import Job, JobList, JobLog, JobRequest, JobState, Region
from schemas.api.plans import PlanDocument
from service.api.authentication import ChangedJob, CurrentUser, JobId
from service.api.bodies import JsonBody
from service.api.routes.parameters import (
    IdempotencyKey,
    LabelFilter,
    Prefer,
    json_request,
    preferred_wait,
    problem,
)
from service.jobs import lifecycle as jobs
from service.jobs import logs as job_logs
from service.jobs import submission as submissions
from service.jobs.context import Here

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

UNKNOWN = problem(404, "There is no such job.")
NOT_YOURS = problem(403, "The job belongs to another user.")
GONE = problem(410, "The job ended without a picture, and its request is gone.")
CANCELLING: dict[int | str, dict[str, Any]] = {
    202: {"model": Job, "description": "The job is still being stopped: `cancelling` is true."}
}
BODY = (
    problem(408, "The body came too slowly.")
    | problem(413, "The body is too large.")
    | problem(415, "The body is not JSON, or is compressed.")
    | problem(429, "The service is at its limit of requests in progress.")
)


@router.post(
    "",
    status_code=202,
    responses=BODY
    | problem(
        422, "The request cannot be used; every reason is listed. Or its Idempotency-Key came with another."
    )
    | problem(429, "The job does not fit into the queue now; `Retry-After` says when to try again."),
    openapi_extra=json_request(JobRequest),
)
async def submit(
    here: Here,
    request: Request,
    response: Response,
    user: CurrentUser,
    body: JsonBody,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Job:
    """Submit a scene. With `Prefer: wait=N` the answer comes when the job ends or N seconds have passed.

    An equal picture in the store is the answer at once, unless `Cache-Control: no-cache` is sent.
    """
    anew = "no-cache" in request.headers.get("cache-control", "").lower()
    sent = submissions.Submission(user, body, idempotency_key, anew)
    submitted = await here.read(submissions.submit, here, sent)
    wait = preferred_wait(prefer, here.settings.max_wait_seconds)
    if wait:
        await jobs.until(here, submitted.job, wait, lambda status: status.state.final)
        response.headers["Preference-Applied"] = f"wait={wait:g}"
    job = await run_in_threadpool(jobs.show, here, submitted.job)
    response.headers["Location"] = job.links.self
    if submitted.replayed:
        response.headers["Idempotency-Replayed"] = "true"
    if submitted.queue:
        response.headers.update(submitted.queue.headers())
    return job


@router.get("", responses=problem(422, "A parameter cannot be used."))
def list_jobs(
    here: Here,
    user: CurrentUser,
    limit: Annotated[int, Query(ge=1, le=100, description="Jobs on a page.")] = 20,
    cursor: Annotated[
        int | None,
        Query(ge=1, le=2**31 - 1, description="`next` of the page before; the newest jobs without it."),
    ] = None,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    label: Annotated[
        list[LabelFilter] | None,
        Query(
            max_length=16,
            description="`name:value`: only jobs with this label, or with all of them if there are several.",
        ),
    ] = None,
) -> JobList:
    """List jobs, newest first: your own, or for staff those of all users."""
    labels = dict(text.split(":", 1) for text in label or ())
    owner = None if user.sees_all else user.name
    return jobs.page(here, limit, cursor, owner=owner, state=state, labels=labels)


@router.get("/{job_id}", responses=UNKNOWN)
def get_job(here: Here, job_id: JobId) -> Job:
    """Describe a job."""
    return jobs.show(here, job_id)


@router.post("/{job_id}/cancel", responses=UNKNOWN | NOT_YOURS | CANCELLING)
async def cancel_job(here: Here, response: Response, job_id: ChangedJob) -> Job:
    """Stop a job. The answer comes when no part of it runs any more. A job that has ended stays as it is.

    If that takes more than a few seconds the answer is 202, and `cancelling` is true until it has ended.
    """
    job = await jobs.stop(here, job_id)
    if not job.state.final:
        response.status_code = 202
    return job


@router.post("/{job_id}/pause", responses=UNKNOWN | NOT_YOURS)
def pause_job(here: Here, job_id: ChangedJob) -> Job:
    """Pause a job: tiles in progress are finished, no more are started, and time limits stop.

    If others requested the same picture, it continues for them. A job that has ended stays as it is.
    """
    return jobs.pause(here, job_id)


@router.post("/{job_id}/resume", responses=UNKNOWN | NOT_YOURS)
def resume_job(here: Here, job_id: ChangedJob) -> Job:
    """Resume a paused job. Other jobs stay as they are."""
    return jobs.resume(here, job_id)


@router.delete(
    "/{job_id}",
    status_code=204,
    response_class=Response,
    responses=UNKNOWN | NOT_YOURS | problem(503, "The job is still being stopped."),
)
async def delete_job(here: Here, job_id: ChangedJob) -> None:
    """Stop a job if it runs, and remove it with everything it made."""
    await jobs.remove(here, job_id)


@router.get("/{job_id}/plan", responses=UNKNOWN)
def get_plan(here: Here, job_id: JobId) -> PlanDocument:
    """Show the plan of a job, and which lines of the scene each stage comes from."""
    return jobs.plan_of(here, job_id)


@router.get("/{job_id}/log", responses=UNKNOWN)
def get_log(here: Here, job_id: JobId) -> JobLog:
    """Report the history of a job: states, passes, repeated steps, workers lost, failures."""
    return job_logs.log_of(here, job_id)


@router.get("/{job_id}/request", response_model=JobRequest, responses=UNKNOWN)
def get_request(here: Here, job_id: JobId) -> Response:
    """Return the body that the job was submitted with, byte for byte."""
    return Response(jobs.request_of(here, job_id), media_type="application/json")


REGION: dict[str, Any] = {"x0": 0, "y0": 0, "x1": 64, "y1": 64}


@router.post(
    "/{job_id}/focus",
    status_code=204,
    response_class=Response,
    responses=BODY | UNKNOWN | NOT_YOURS | GONE | problem(422, "The rectangle cannot be used."),
    openapi_extra=json_request(Region, REGION),
)
async def set_focus(here: Here, job_id: ChangedJob, body: JsonBody) -> None:
    """Render a rectangle of the picture before the rest of each pass."""
    await run_in_threadpool(jobs.focus, here, job_id, body)


@router.put(
    "/{job_id}/pin",
    responses=UNKNOWN | GONE | problem(403, "You have pinned as many jobs as you may."),
)
def pin_job(here: Here, user: CurrentUser, job_id: JobId) -> Job:
    """Keep the picture of a job until it is unpinned or deleted. For its owner and staff."""
    return jobs.pin(here, job_id, user)


@router.delete("/{job_id}/pin", responses=UNKNOWN)
def unpin_job(here: Here, job_id: JobId) -> Job:
    """Let the picture of a job expire like any other."""
    return jobs.unpin(here, job_id)
