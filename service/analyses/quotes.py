"""Finding out what a picture would cost, by a pilot in a worker."""

from __future__ import annotations

import asyncio

from schemas.jobs import JobRequest
from schemas.quotes import Quote, QuoteRequest
from schemas.request_pointers import in_request
from service.access.principals import Asker
from service.errors import QuoteFailedError, UnavailableError, WorkerLostError
from service.jobs.admission import compile_admitted, read_request
from service.jobs.context import Service
from service.workers.tasks import Outcome, QuoteDone, QuoteTask, TaskFailed


async def quote(service: Service, asker: Asker, body: bytes) -> Quote:
    """Answer a user's request for a quote.

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
    with service.quote_seats.taken():
        task = await service.read(_task, service, asker, body)
        answer = asyncio.wrap_future(service.dispatcher.call(task))
        try:
            outcome = await asyncio.wait_for(answer, service.settings.max_wait_seconds)
        except TimeoutError:
            detail = "No worker was free for a quote in time. Try again in a moment."
            raise UnavailableError(detail) from None
        found = _quote(outcome)
    if found.asked is not None:
        service.prices.learn(_job(task.request), found.asked.cpu_seconds.estimate)
    return in_request(found, task.request)


def _task(service: Service, asker: Asker, body: bytes) -> QuoteTask:
    request, _ = read_request(service, asker, body, QuoteRequest)
    compile_admitted(_job(request))
    return QuoteTask(request, service.settings.workers)


def _job(request: QuoteRequest) -> JobRequest:
    """The job that is quoted."""
    return JobRequest(scene=request.scene, quality=request.quality)


def _quote(outcome: Outcome) -> Quote:
    if isinstance(outcome, TaskFailed):
        raise QuoteFailedError(outcome.message)
    if not isinstance(outcome, QuoteDone):
        raise WorkerLostError("The worker died while it made this quote.")
    return outcome.quote
