"""Quotes, previews, traces and inspected pixels: a worker computes them while the client waits."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

import renderer
from schemas.api.inspections import Inspection, InspectionRequest, TraceRequest
from schemas.api.jobs import JobRequest
from schemas.api.plans import Quote, QuoteRequest
from schemas.api.previews import PreviewRequest
from schemas.api.request_pointers import in_request
from schemas.errors import Problem
from schemas.reading import read_document
from service.access.principals import Principal
from service.jobs import lifecycle as jobs
from service.jobs.admission import read_request
from service.jobs.context import Service
from service.jobs.worker_calls import ask_worker
from service.workers.tasks import InspectTask, PreviewTask, QuoteTask, TraceTask


async def quote(service: Service, principal: Principal, body: bytes) -> Quote:
    """Predict the cost of a picture by a pilot; raises as `ask_worker` does."""
    task, found = await ask_worker(service, principal, _quote_task, body)
    quoted: Quote = in_request(found, task.request)
    if quoted.asked is not None:
        service.prices.learn(_quoted_job(task.request), quoted.asked.cpu_seconds.estimate)
    return quoted


def _quote_task(service: Service, principal: Principal, body: bytes) -> QuoteTask:
    request, _ = read_request(service, principal, body, QuoteRequest)
    return QuoteTask(request, service.settings.workers, user=principal.name)


def _quoted_job(request: QuoteRequest) -> JobRequest:
    return JobRequest(scene=request.scene, quality=request.quality)


async def preview(service: Service, principal: Principal, body: bytes) -> bytes:
    """Render a small picture of a scene, a PNG file; no job is created.

    Raises as `ask_worker` does, and where even a small picture takes too long.
    """
    _, png = await ask_worker(service, principal, _preview_task, body)
    return bytes(png)


def _preview_task(service: Service, principal: Principal, body: bytes) -> PreviewTask:
    request, _ = read_request(service, principal, body, PreviewRequest)
    return PreviewTask(request.small_scene, service.settings.workers, user=principal.name)


async def trace(service: Service, principal: Principal, body: bytes) -> bytes:
    """Cast the rays of a user's request, and return a `TraceAnswer` as JSON; raises as `ask_worker` does."""
    _, answer = await ask_worker(service, principal, _trace_task, body)
    return bytes(answer)


def _trace_task(service: Service, principal: Principal, body: bytes) -> TraceTask:
    request, _ = read_request(service, principal, body, TraceRequest, limits=service.settings.trace_limits)
    problems = list(_ray_problems(request, service.settings.max_trace_rays))
    if problems:
        raise renderer.SceneError(problems)
    origins, directions = (
        np.array(rows, np.float64).reshape(-1, 3) for rows in (request.origins, request.directions)
    )
    return TraceTask(request.scene, origins, directions, user=principal.name)


def _ray_problems(request: TraceRequest, limit: int) -> Iterator[Problem]:
    if len(request.origins) > limit:
        detail = f"At most {limit} rays are traced in one request. Send them in parts."
        yield Problem(pointer="/origins", detail=detail, code="too_many")
    if len(request.directions) != len(request.origins):
        detail = "There must be one direction for each origin."
        yield Problem(pointer="/directions", detail=detail, code="length")


async def inspect(service: Service, principal: Principal, job_id: str, body: bytes) -> Inspection:
    """Explain a pixel of a job; the job need not have begun.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    PictureGoneError
        If the job has ended without a picture, and its scene is gone.
    renderer.SceneError
        If the request cannot be used, or the picture has no such pixel.
    ServiceError
        As `ask_worker` raises it.
    """
    request = await service.read(principal.name, _request_of, service, job_id)
    _, found = await ask_worker(service, principal, _inspect_task, job_id, body)
    inspection: Inspection = in_request(found, request)
    return inspection


def _request_of(service: Service, job_id: str) -> JobRequest:
    """Read the request of a job, to which pointers of the answer lead."""
    return JobRequest.model_validate(json.loads(jobs.request_of(service, job_id)))


def _inspect_task(service: Service, principal: Principal, job_id: str, body: bytes) -> InspectTask:
    with service.database.reading() as session:
        render = jobs.find_render(session, job_id)
    asked, _ = read_document(body, InspectionRequest, limits=service.settings.limits)
    sides = (("x", asked.x, render.width, "columns"), ("y", asked.y, render.height, "rows"))
    problems = [
        Problem(
            pointer=f"/{name}",
            detail=f"The picture has {size} {lines}, 0 to {size - 1}.",
            code="out_of_range",
        )
        for name, place, size, lines in sides
        if place >= size
    ]
    if problems:
        raise renderer.SceneError(problems)
    return InspectTask(render.id, render.spec_sha256, asked.x, asked.y, user=principal.name)
