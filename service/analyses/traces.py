"""Casting rays for a request, in a worker."""

from __future__ import annotations

from typing import Any

import numpy as np
from fastapi.concurrency import run_in_threadpool

import renderer
from schemas.jobs import JobRequest
from schemas.problems import Problem
from schemas.traces import TraceAnswer, TraceRequest
from service.access.principals import Principal
from service.analyses.worker_calls import WorkerCall
from service.errors import TraceFailedError
from service.jobs.admission import compile_admitted, read_request
from service.jobs.context import Service
from service.workers.tasks import TraceDone, TraceTask

TRACING = WorkerCall(
    TraceDone,
    TraceFailedError,
    timed_out="Tracing took too long. Send fewer rays, or a smaller scene.",
    worker_died="The worker died while it traced these rays.",
)


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
    task = await service.read(_task, service, principal, body)
    done = await TRACING.ask(service, task)
    return await run_in_threadpool(_answer, done)


def _task(service: Service, principal: Principal, body: bytes) -> TraceTask:
    request, _ = read_request(service, principal, body, TraceRequest, limits=service.settings.trace_limits)
    problems = list(_problems(request, service.settings.max_trace_rays))
    if problems:
        raise renderer.SceneError(problems)
    compile_admitted(JobRequest(scene=request.scene))
    return TraceTask(request.scene, _rows(request.origins), _rows(request.directions))


def _problems(request: TraceRequest, limit: int) -> list[Problem]:
    problems = []
    if len(request.origins) > limit:
        detail = f"At most {limit} rays are traced in one request. Send them in parts."
        problems.append(Problem(pointer="/origins", detail=detail, code="too_many"))
    if len(request.directions) != len(request.origins):
        detail = "There must be one direction for each origin."
        problems.append(Problem(pointer="/directions", detail=detail, code="length"))
    return problems


def _rows(rows: tuple[tuple[float, float, float], ...]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array(rows, np.float64).reshape(-1, 3)


def _answer(done: TraceDone) -> TraceAnswer:
    hits = {name: array.tolist() for name, array in done.hits.items()}
    missed = [shape < 0 for shape in hits["shape"]]
    for name in ("t", "position", "normal", "uv"):
        hits[name] = [None if miss else value for value, miss in zip(hits[name], missed, strict=True)]
    return TraceAnswer.model_validate(hits)
