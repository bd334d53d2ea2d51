"""Finding out what a picture would cost, by a pilot in a worker."""

from __future__ import annotations

from schemas.jobs import JobRequest
from schemas.quotes import Quote, QuoteRequest
from schemas.request_pointers import in_request
from service.access.principals import Principal
from service.analyses.worker_calls import WorkerCall
from service.errors import QuoteFailedError
from service.jobs.admission import compile_admitted, read_request
from service.jobs.context import Service
from service.workers.tasks import QuoteDone, QuoteTask

QUOTING = WorkerCall(
    QuoteDone,
    QuoteFailedError,
    timed_out="No worker was free for a quote in time. Try again in a moment.",
    worker_died="The worker died while it made this quote.",
)


async def quote(service: Service, principal: Principal, body: bytes) -> Quote:
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
    with service.quote_limit.acquired():
        task = await service.read(_task, service, principal, body)
        found = (await QUOTING.ask(service, task)).quote
    if found.asked is not None:
        service.prices.learn(_job(task.request), found.asked.cpu_seconds.estimate)
    return in_request(found, task.request)


def _task(service: Service, principal: Principal, body: bytes) -> QuoteTask:
    request, _ = read_request(service, principal, body, QuoteRequest)
    compile_admitted(_job(request))
    return QuoteTask(request, service.settings.workers)


def _job(request: QuoteRequest) -> JobRequest:
    """The job that is quoted."""
    return JobRequest(scene=request.scene, quality=request.quality)
