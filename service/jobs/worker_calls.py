"""Calls, which a worker computes while the client waits for the answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

import renderer
from service.access.principals import Principal
from service.errors import (
    ComparisonFailedError,
    InspectionFailedError,
    PlanFailedError,
    PreviewFailedError,
    QuoteFailedError,
    ServiceError,
    TraceFailedError,
    UnavailableError,
    WorkerLostError,
)
from service.jobs.context import Service
from service.workers.tasks import (
    CallDone,
    CallRefused,
    CallTask,
    CompareTask,
    InspectTask,
    PlanTask,
    PreviewTask,
    QuoteTask,
    TaskFailed,
    TraceTask,
)

Task = TypeVar("Task", bound=CallTask)

CALLS: dict[type[CallTask], tuple[str, type[ServiceError]]] = {
    PlanTask: ("this scene", PlanFailedError),
    QuoteTask: ("this quote", QuoteFailedError),
    PreviewTask: ("this preview", PreviewFailedError),
    TraceTask: ("these rays", TraceFailedError),
    InspectTask: ("this pixel", InspectionFailedError),
    CompareTask: ("these pictures", ComparisonFailedError),
}
"""Subject of each worker call in messages, and its error if it fails."""


async def ask_worker(
    service: Service, principal: Principal, make: Callable[..., Task], *given: Any
) -> tuple[Task, Any]:
    """Have a worker answer a call while a request waits.

    Parameters
    ----------
    make
        Makes the task of the service, the user, and what is ``given``.

    Returns
    -------
    tuple
        The task, and the answer.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used, as ``make`` or the worker has found.
    BusyError
        If the user has too many calls in progress.
    ServiceError
        That of `CALLS`, if the task failed.
    UnavailableError
        If no answer came in time, or the worker died.
    """
    with service.dispatcher.desk.place(principal.name):
        task = await service.read(principal.name, make, service, principal, *given)
        return task, await _answer(service, task)


async def _answer(service: Service, task: CallTask) -> Any:
    subject, failure = CALLS[type(task)]
    answer = asyncio.wrap_future(service.dispatcher.desk.ask(task))
    try:
        outcome = await asyncio.wait_for(answer, service.settings.max_wait_seconds)
    except TimeoutError:
        raise UnavailableError(f"No worker has finished {subject} in time. Try again in a moment.") from None
    match outcome:
        case CallDone(answer=done):
            return done
        case CallRefused(problems=problems, more=more):
            raise renderer.SceneError(problems, more)
        case TaskFailed(message=message):
            raise failure(message)
        case _:
            raise WorkerLostError(f"The worker died while it worked on {subject}.")
