"""Staying with a job, whoever sends the requests: what to ask for next, and when to stop."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeVar

from schemas.jobs import Job, JobState, TileBatch
from service.client.batches import PixelBatch
from service.client.errors import (
    JobCancelledError,
    JobExpiredError,
    JobFailedError,
    TimedOutError,
    how_to_go_on,
)

Held = TypeVar("Held", bound=Job)

OnProgress = Callable[[TileBatch], None]
AsyncOnProgress = Callable[[TileBatch], Awaitable[None] | None]
"""A function or a coroutine function."""

LONGEST_HOLD = 20.0
"""Seconds for which the server is asked to hold back an answer; proxies tend to cut connections after 30."""


@dataclass(slots=True)
class Following:
    """How far somebody is who follows a job.

    Attributes
    ----------
    job_id
        The job.
    after
        Number of the last event seen.
    timeout
        Seconds until it is enough; None for no end.
    """

    job_id: str
    after: int = 0
    timeout: float | None = None
    _begun: float = field(default_factory=time.monotonic)

    @property
    def hold(self) -> float:
        """Seconds for which the next request may be held back."""
        return LONGEST_HOLD if self.timeout is None else max(0.0, min(LONGEST_HOLD, self._left()))

    def goes_on(self, batch: TileBatch | PixelBatch) -> bool:
        """Take note of a batch, and say whether another follows.

        Raises
        ------
        TimedOutError
            The job has not ended, and the time is over.
        """
        self.after = batch.next
        if not batch.complete and self.timeout is not None and self._left() <= 0:
            raise TimedOutError(
                f"Job {self.job_id} goes on after {self.timeout:g} s of waiting.", job_id=self.job_id
            )
        return not batch.complete

    def _left(self) -> float:
        assert self.timeout is not None
        return self._begun + self.timeout - time.monotonic()


def notify(on_progress: OnProgress | None, batch: TileBatch) -> None:
    """Report a batch to whoever asked for that."""
    if on_progress is not None:
        on_progress(batch)


async def notify_async(on_progress: AsyncOnProgress | None, batch: TileBatch) -> None:
    """Report a batch to whoever asked for that, and wait for a coroutine."""
    if on_progress is not None and (pending := on_progress(batch)) is not None:
        await pending


@contextmanager
def leaving(job_id: str) -> Iterator[None]:
    """Say on the way out, after Ctrl-C or when a task is cancelled, that the job goes on."""
    try:
        yield
    except GeneratorExit:
        raise
    except BaseException as error:
        if not isinstance(error, Exception):
            error.add_note(f"Job {job_id} goes on: only the waiting has ended. {how_to_go_on(job_id)}")
        raise


def succeeded(job: Held) -> Held:
    """Give a job back that has ended well; raise what became of any other.

    Raises
    ------
    NoImageError
        There will be no image.
    """
    if job.failure is not None:
        raise JobFailedError(job_id=job.id, failure=job.failure)
    if job.state is JobState.CANCELLED:
        raise JobCancelledError(job_id=job.id)
    if job.state is JobState.EXPIRED:
        raise JobExpiredError(job_id=job.id)
    return job
