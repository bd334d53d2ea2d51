"""Quotes, traces and inspected pixels: a worker computes them while the client waits."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from fastapi.concurrency import run_in_threadpool

import renderer
from schemas.api.inspections import Inspection, InspectionRequest, TraceAnswer, TraceRequest
from schemas.api.jobs import JobRequest
from schemas.api.plans import Quote, QuoteRequest
from schemas.api.previews import PREVIEW_QUALITY, PreviewRequest
from schemas.api.request_pointers import in_request
from schemas.errors import Problem
from schemas.reading import read_document
from service.access.principals import Principal
from service.errors import (
    InspectionFailedError,
    PreviewFailedError,
    QuoteFailedError,
    ServiceError,
    TraceFailedError,
    UnavailableError,
    WorkerLostError,
)
from service.jobs import lifecycle as jobs
from service.jobs.admission import compile_admitted, read_request
from service.jobs.context import Service
from service.jobs.limits import bounded
from service.jobs.pricing import priced
from service.workers.tasks import (
    CallDone,
    CallTask,
    CompareRefused,
    InspectDone,
    InspectTask,
    PreviewDone,
    PreviewTask,
    QuoteDone,
    QuoteTask,
    TaskFailed,
    TraceDone,
    TraceTask,
)

# More would keep a worker from jobs, for a picture that is replaced at the next edit.
MOST_PREVIEW_SECONDS = 10.0

Done = TypeVar("Done", bound=CallDone)


async def ask_worker(
    service: Service,
    task: CallTask,
    done: type[Done],
    failure: type[ServiceError],
    *,
    timed_out: str,
    worker_died: str,
) -> Done:
    """Have a worker answer a task while a request waits.

    Parameters
    ----------
    done
        The outcome of a task that was answered.
    failure
        Raised with the worker's message where the task failed.
    timed_out, worker_died
        Messages for the user where no answer came.

    Raises
    ------
    SceneError
        If the worker found that the request cannot be used.
    ServiceError
        `failure`, if the task failed.
    UnavailableError
        If no answer came in time, or the worker died.
    """
    answer = asyncio.wrap_future(service.dispatcher.call(task))
    try:
        outcome = await asyncio.wait_for(answer, service.settings.max_wait_seconds)
    except TimeoutError:
        raise UnavailableError(timed_out) from None
    if isinstance(outcome, CompareRefused):
        raise renderer.SceneError([outcome.problem])
    if isinstance(outcome, TaskFailed):
        raise failure(outcome.message)
    if not isinstance(outcome, done):
        raise WorkerLostError(worker_died)
    return outcome


async def quote(service: Service, principal: Principal, body: bytes) -> Quote:
    """Predict by a pilot what a picture would cost.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used.
    BusyError
        If too many quotes are being made.
    QuoteFailedError
        If the renderer refuses the scene.
    UnavailableError
        If it took too long, or its worker died.
    """
    async with bounded(service.quote_limit, "quotes"):
        task = await service.read(_quote_task, service, principal, body)
        done = await ask_worker(
            service,
            task,
            QuoteDone,
            QuoteFailedError,
            timed_out="No worker was free for a quote in time. Try again in a moment.",
            worker_died="The worker died while it made this quote.",
        )
    found = done.quote
    if found.asked is not None:
        service.prices.learn(_quoted_job(task.request), found.asked.cpu_seconds.estimate)
    return in_request(found, task.request)


def _quote_task(service: Service, principal: Principal, body: bytes) -> QuoteTask:
    request, _ = read_request(service, principal, body, QuoteRequest)
    compile_admitted(_quoted_job(request))
    return QuoteTask(request, service.settings.workers)


def _quoted_job(request: QuoteRequest) -> JobRequest:
    return JobRequest(scene=request.scene, quality=request.quality)


async def preview(service: Service, principal: Principal, body: bytes) -> bytes:
    """Render a small picture of a scene, a PNG file; no job is created.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used, or even a small picture takes too long.
    BusyError
        If too many quotes and previews are being made.
    PreviewFailedError
        If the renderer refuses the scene.
    UnavailableError
        If it took too long, or its worker died.
    """
    async with bounded(service.quote_limit, "quotes and previews"):
        task = await service.read(_preview_task, service, principal, body)
        done = await ask_worker(
            service,
            task,
            PreviewDone,
            PreviewFailedError,
            timed_out="No worker was free for a preview in time. Try again in a moment.",
            worker_died="The worker died while it rendered this preview.",
        )
    return done.png


def _preview_task(service: Service, principal: Principal, body: bytes) -> PreviewTask:
    request, _ = read_request(service, principal, body, PreviewRequest)
    scene = request.small_scene
    plan = compile_admitted(JobRequest(scene=scene, quality=PREVIEW_QUALITY))
    seconds = priced(plan, None, service.settings.workers).cost.cpu_seconds
    if seconds > MOST_PREVIEW_SECONDS:
        detail = (
            f"Even a preview is predicted to take {seconds:.0f} CPU seconds, more than the "
            f"{MOST_PREVIEW_SECONDS:.0f} allowed. Render the scene as a job."
        )
        raise renderer.SceneError([Problem(pointer="/scene", detail=detail, code="cost")])
    return PreviewTask(scene)


async def trace(service: Service, principal: Principal, body: bytes) -> TraceAnswer:
    """Cast the rays of a user's request.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used.
    TraceFailedError
        If the renderer refuses the rays.
    UnavailableError
        If it took too long, or its worker died.
    """
    task = await service.read(_trace_task, service, principal, body)
    done = await ask_worker(
        service,
        task,
        TraceDone,
        TraceFailedError,
        timed_out="Tracing took too long. Send fewer rays, or a smaller scene.",
        worker_died="The worker died while it traced these rays.",
    )
    return await run_in_threadpool(_trace_answer, done)


def _trace_task(service: Service, principal: Principal, body: bytes) -> TraceTask:
    request, _ = read_request(service, principal, body, TraceRequest, limits=service.settings.trace_limits)
    problems = list(_ray_problems(request, service.settings.max_trace_rays))
    if problems:
        raise renderer.SceneError(problems)
    compile_admitted(JobRequest(scene=request.scene))
    origins, directions = (
        np.array(rows, np.float64).reshape(-1, 3) for rows in (request.origins, request.directions)
    )
    return TraceTask(request.scene, origins, directions)


def _ray_problems(request: TraceRequest, limit: int) -> Iterator[Problem]:
    if len(request.origins) > limit:
        detail = f"At most {limit} rays are traced in one request. Send them in parts."
        yield Problem(pointer="/origins", detail=detail, code="too_many")
    if len(request.directions) != len(request.origins):
        detail = "There must be one direction for each origin."
        yield Problem(pointer="/directions", detail=detail, code="length")


def _trace_answer(done: TraceDone) -> TraceAnswer:
    hits: dict[str, Any] = {name: array.tolist() for name, array in done.hits.items()}
    missed = [shape < 0 for shape in hits["shape"]]
    for name in ("t", "position", "normal", "uv"):
        hits[name] = [None if miss else value for value, miss in zip(hits[name], missed, strict=True)]
    return TraceAnswer.model_validate(hits)


async def inspect(service: Service, job_id: str, body: bytes) -> Inspection:
    """Explain a pixel of a job; the job need not have begun.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    PictureGoneError
        If the job has ended without a picture, and its scene is gone.
    renderer.SceneError
        If the request cannot be used, or the picture has no such pixel.
    InspectionFailedError
        If the renderer fails, for want of memory.
    UnavailableError
        If it took too long, or its worker died.
    """
    task, request = await service.read(_inspect_task, service, job_id, body)
    done = await ask_worker(
        service,
        task,
        InspectDone,
        InspectionFailedError,
        timed_out="No worker was free to inspect the pixel in time. Try again in a moment.",
        worker_died="The worker died while it inspected this pixel.",
    )
    return in_request(done.inspection, request)


def _inspect_task(service: Service, job_id: str, body: bytes) -> tuple[InspectTask, JobRequest]:
    """Make the task, and read the request of the job, to which pointers of the answer lead."""
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
    request = JobRequest.model_validate(json.loads(jobs.request_of(service, job_id)))
    return InspectTask(render.id, render.spec_sha256, asked.x, asked.y), request
