"""Explaining a pixel of a job, in a worker."""

from __future__ import annotations

import json

import renderer
from schemas.inspections import Inspection, InspectionRequest
from schemas.jobs import JobRequest
from schemas.problems import Problem
from schemas.reading import read_document
from schemas.request_pointers import in_request
from service.analyses.worker_calls import WorkerCall
from service.errors import InspectionFailedError
from service.jobs import lifecycle as jobs
from service.jobs.context import Service
from service.jobs.lifecycle import request_of
from service.workers.tasks import InspectDone, InspectTask

INSPECTING = WorkerCall(
    InspectDone,
    InspectionFailedError,
    timed_out="No worker was free to look in time. Try again in a moment.",
    worker_died="The worker died while it looked at this pixel.",
)


async def inspect(service: Service, job_id: str, body: bytes) -> Inspection:
    """Explain the pixel of a request; the job need not have begun.

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
    task, request = await service.read(_task, service, job_id, body)
    done = await INSPECTING.ask(service, task)
    return in_request(done.inspection, request)


def _task(service: Service, job_id: str, body: bytes) -> tuple[InspectTask, JobRequest]:
    """Make the task, and read the request of the job, whose lines the answer speaks of."""
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
    request = JobRequest.model_validate(json.loads(request_of(service, job_id)))
    return InspectTask(render.id, render.spec_sha256, asked.x, asked.y), request
