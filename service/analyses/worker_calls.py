"""A question to a worker while a request waits: hand over the task, wait with a limit, translate errors."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Generic, TypeVar

from schemas.errors import SceneError
from service.errors import ServiceError, UnavailableError, WorkerLostError
from service.jobs.context import Service
from service.workers.tasks import CallDone, CallTask, CompareRefused, Outcome, TaskFailed

Done = TypeVar("Done", bound=CallDone)


@dataclass(frozen=True)
class WorkerCall(Generic[Done]):
    """One kind of question.

    Attributes
    ----------
    done
        The outcome of a task that was answered.
    failure
        Raised, with the message of the worker, where the task failed.
    timed_out, worker_died
        What the user reads where no answer came.
    """

    done: type[Done]
    failure: type[ServiceError]
    timed_out: str
    worker_died: str

    async def ask(self, service: Service, task: CallTask) -> Done:
        """Have a worker answer a task.

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
            raise UnavailableError(self.timed_out) from None
        return self._answer(outcome)

    def _answer(self, outcome: Outcome) -> Done:
        if isinstance(outcome, CompareRefused):
            raise SceneError([outcome.problem])
        if isinstance(outcome, TaskFailed):
            raise self.failure(outcome.message)
        if not isinstance(outcome, self.done):
            raise WorkerLostError(self.worker_died)
        return outcome
