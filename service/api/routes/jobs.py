"""Jobs: submit, show, list, cancel, pause, pin, delete."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from schemas.api.jobs import Job, JobList, JobLog, JobRequest, JobState, Region
from schemas.api.plans import PlanDocument
from service.api.authentication import ChangedJob, CurrentUser, JobId
from service.api.bodies import JsonBody, while_connected
from service.api.request_headers import joined
from service.api.routes.parameters import (
    IdempotencyKey,
    LabelFilter,
    Prefer,
    json_request,
    preferred_wait,
    problem,
)
from service.errors import BusyError
from service.jobs import lifecycle as jobs
from service.jobs import listing
from service.jobs import logs as job_logs
from service.jobs import submission as submissions
from service.jobs.context import Here
from service.jobs.entry import enter
from service.jobs.listing import NEWEST_FIRST, Listing, Sort

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

UNKNOWN = problem(404, "There is no such job.", "unknown_job")
NOT_YOURS = problem(403, "The job belongs to another user.", "forbidden")
GONE = problem(410, "The job ended without a picture.", "picture_gone")
CANCELLING: dict[int | str, dict[str, Any]] = {
    202: {"model": Job, "description": "The job is still being stopped: `cancelling` is true."}
}
BODY = (
    problem(408, "The body arrived too slowly.", "body_slow")
    | problem(413, "The body is too large.", "body_too_large")
    | problem(415, "The body is not JSON, or it is compressed.", "media_type")
    | problem(429, "The service is at its limit of concurrent requests.", "busy")
)


@router.post(
    "",
    status_code=202,
    summary="Submit a job",
    response_description="The job is accepted. `Location` has its URL.",
    responses=BODY
    | problem(
        422,
        "The request cannot be used; `errors` lists every reason. Or its `Idempotency-Key` was used for a "
        "different request.",
        "scene_not_usable",
        "plan_failed",
        "idempotency_key_reused",
    )
    | problem(
        429, "The queue has no room for the job; `Retry-After` says when to try again.", "queue_full", "busy"
    )
    | problem(
        503,
        "A file of the scene was deleted meanwhile, or no worker planned it in time. Send the request again.",
        "unavailable",
        "worker_lost",
    ),
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
    """Submit a scene to be rendered.

    With `Prefer: wait=N` the response comes when the job has ended, or after N seconds. If the service has
    the same picture already, the job has succeeded at once; `Cache-Control: no-cache` renders it again.
    """
    anew = "no-cache" in joined(request, "cache-control").lower()
    sent = submissions.Submission(user, body, idempotency_key, anew)
    prepared = await submissions.prepare(here, sent)
    if isinstance(prepared, submissions.Prepared):
        submitted = await here.write(enter, here, prepared)
    else:
        submitted = prepared
    wait = preferred_wait(prefer, here.settings.max_wait_seconds)
    # The job is accepted in any case, and a preference need not be honoured.
    with suppress(BusyError):
        if wait:
            with here.streams.waiting(user):
                ended = jobs.until(here, submitted.job, wait, lambda status: status.state.final)
                await while_connected(request, ended)
            response.headers["Preference-Applied"] = f"wait={wait:g}"
    job = await run_in_threadpool(jobs.show, here, submitted.job)
    response.headers["Location"] = job.links.self
    if submitted.replayed:
        response.headers["Idempotency-Replayed"] = "true"
    if submitted.queue:
        response.headers.update(submitted.queue.headers())
    return job


def _listing(
    user: CurrentUser,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    label: Annotated[
        list[LabelFilter] | None,
        Query(
            max_length=16,
            description="`name:value`: only jobs with this label. If repeated, jobs with a value of "
            "each name.",
        ),
    ] = None,
    search: Annotated[
        str,
        Query(
            max_length=200,
            pattern=r"^[^\x00]*$",
            description="Only jobs with this text in their name or in a label `name:value`; the case of "
            "ASCII letters is ignored.",
        ),
    ] = "",
    sort: Annotated[
        Sort, Query(description="The order; `-` reverses it. Equal names and users: newest first.")
    ] = NEWEST_FIRST,
) -> Listing:
    labels: dict[str, list[str]] = {}
    for name, value in (text.split(":", 1) for text in label or ()):
        labels.setdefault(name, []).append(value)
    return Listing(None if user.sees_all else user.name, state, labels, search, sort)


@router.get("", summary="List jobs", response_description="One page of jobs.")
def list_jobs(
    here: Here,
    wanted: Annotated[Listing, Depends(_listing)],
    limit: Annotated[int, Query(ge=1, le=100, description="Jobs on a page.")] = 20,
    cursor: Annotated[
        int | None,
        Query(ge=1, le=2**31 - 1, description="`next` of the previous page. Without it you get the first."),
    ] = None,
    total: Annotated[bool, Query(description="Whether to count the jobs of all pages.")] = False,
) -> JobList:
    """List jobs: your own, or everyone's if you are staff.

    Searching, counting, and any order but newest first see the newest 10,000 of them.
    """
    return listing.page(here, wanted, limit, cursor, total=total)


@router.get("/{job_id}", summary="Get a job", response_description="The job as it is now.", responses=UNKNOWN)
def get_job(here: Here, job_id: JobId) -> Job:
    """Get the state of a job, its progress, cost and error, and links to all that belongs to it."""
    return jobs.show(here, job_id)


@router.post(
    "/{job_id}/cancel",
    summary="Cancel a job",
    response_description="The job; no part of it runs any more.",
    responses=UNKNOWN | NOT_YOURS | CANCELLING,
)
async def cancel_job(here: Here, response: Response, job_id: ChangedJob) -> Job:
    """Stop a job. The response comes when no part of it runs any more. A job that has ended does not change.

    If that takes more than a few seconds, the status is 202, and `cancelling` is true until the job ends.
    """
    job = await jobs.stop(here, job_id)
    if not job.state.final:
        response.status_code = 202
    return job


@router.post(
    "/{job_id}/pause",
    summary="Pause a job",
    response_description="The job, paused.",
    responses=UNKNOWN | NOT_YOURS,
)
async def pause_job(here: Here, job_id: ChangedJob) -> Job:
    """Pause a job. Workers finish the tiles that they hold and get no more of them.

    The time limit is suspended. If other jobs share the picture, it continues for them. A job that has
    ended does not change.
    """
    return await here.write(jobs.pause, here, job_id)


@router.post(
    "/{job_id}/resume",
    summary="Resume a job",
    response_description="The job, no longer paused.",
    responses=UNKNOWN | NOT_YOURS,
)
async def resume_job(here: Here, job_id: ChangedJob) -> Job:
    """Resume a paused job. A job that is not paused does not change."""
    return await here.write(jobs.resume, here, job_id)


@router.delete(
    "/{job_id}",
    status_code=204,
    response_class=Response,
    summary="Delete a job",
    response_description="The job is deleted.",
    responses=UNKNOWN
    | NOT_YOURS
    | problem(503, "The job is still being stopped. Delete it again in a moment.", "unavailable"),
)
async def delete_job(here: Here, job_id: ChangedJob) -> None:
    """Stop a job if it runs, and delete it with its picture."""
    await jobs.remove(here, job_id)


@router.get(
    "/{job_id}/plan", summary="Get the plan of a job", response_description="The plan.", responses=UNKNOWN
)
def get_plan(here: Here, job_id: JobId) -> PlanDocument:
    """Get the stages that run for a job, and the parts of its request that each stage comes from."""
    return jobs.plan_of(here, job_id)


@router.get(
    "/{job_id}/log",
    summary="Get the history of a job",
    response_description="What happened, in order.",
    responses=UNKNOWN,
)
def get_log(here: Here, job_id: JobId) -> JobLog:
    """Get the history of a job: when it began, its passes, retried tiles, lost workers, failures."""
    return job_logs.log_of(here, job_id)


@router.get(
    "/{job_id}/request",
    response_model=JobRequest,
    summary="Get the request of a job",
    response_description="The body that was sent, without whitespace.",
    responses=UNKNOWN,
)
def get_request(here: Here, job_id: JobId) -> Response:
    """Get the body that the job was submitted with, as compact JSON."""
    return Response(jobs.request_of(here, job_id), media_type="application/json")


REGION: dict[str, Any] = {"x0": 0, "y0": 0, "x1": 64, "y1": 64}


@router.post(
    "/{job_id}/focus",
    status_code=204,
    response_class=Response,
    summary="Render a rectangle first",
    response_description="The rectangle comes first from now on.",
    responses=BODY
    | UNKNOWN
    | NOT_YOURS
    | GONE
    | problem(422, "The rectangle cannot be used.", "scene_not_usable"),
    openapi_extra=json_request(Region, REGION),
)
async def set_focus(here: Here, job_id: ChangedJob, body: JsonBody) -> None:
    """Render the tiles of a rectangle before the others of their pass. The picture stays the same.

    The order survives a restart of the service. If jobs share a picture, the last request counts.
    """
    await here.write(jobs.focus, here, job_id, body)


@router.put(
    "/{job_id}/pin",
    summary="Pin a job",
    response_description="The job, pinned.",
    responses=UNKNOWN
    | problem(410, "The picture has expired.", "picture_gone")
    | problem(403, "Your pin limit is reached.", "forbidden"),
)
async def pin_job(here: Here, user: CurrentUser, job_id: JobId) -> Job:
    """Keep the picture of a job until the job is unpinned or deleted. For its owner and staff."""
    return await here.write(jobs.pin, here, job_id, user)


@router.delete(
    "/{job_id}/pin", summary="Unpin a job", response_description="The job, not pinned.", responses=UNKNOWN
)
async def unpin_job(here: Here, job_id: JobId) -> Job:
    """Let the picture of a job expire like any other."""
    return await here.write(jobs.unpin, here, job_id)
