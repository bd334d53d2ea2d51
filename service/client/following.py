"""Following a job: the next request, the timeout, progress callbacks, and how the job ended."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeVar

from schemas.api.jobs import Job, JobState, TileBatch
from service.client.batches import PixelBatch
from service.client.calls import checked_seconds
from service.client.errors import (
    JobCancelledError,
    JobExpiredError,
    JobFailedError,
    TimedOutError,
    what_next,
)

AnyJob = TypeVar("AnyJob", bound=Job)

OnProgress = Callable[[TileBatch], None]
AsyncOnProgress = Callable[[TileBatch], Awaitable[None] | None]
"""A function or a coroutine function."""

LONGEST_HOLD = 20.0
"""Seconds that the server may hold back an answer; many proxies cut connections after 30."""


@dataclass(slots=True)
class Following:
    """The place in the events of a job.

    Attributes
    ----------
    after
        Number of the last event seen.
    timeout
        Seconds to follow at most; None for no limit.
    more
        Whether the job has not ended yet.
    """

    job_id: str
    after: int = 0
    timeout: float | None = None
    more: bool = field(default=True, init=False)
    _begun: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        """Refuse a timeout that is not a number."""
        self.timeout = checked_seconds("timeout", self.timeout)

    @property
    def hold(self) -> float:
        """Seconds for which the next request may be held back."""
        return LONGEST_HOLD if self.timeout is None else max(0.0, min(LONGEST_HOLD, self._left()))

    def advance(self, batch: TileBatch | PixelBatch) -> None:
        """Continue after a batch.

        Raises
        ------
        TimedOutError
            The job has not ended, and the time is over.
        """
        self.after, self.more = batch.next, not batch.complete
        if self.more and self.timeout is not None and self._left() <= 0:
            raise TimedOutError(
                f"Job {self.job_id} has not ended after {self.timeout:g} s of waiting.", job_id=self.job_id
            )

    def _left(self) -> float:
        assert self.timeout is not None
        return self._begun + self.timeout - time.monotonic()


def notify(on_progress: OnProgress | None, batch: TileBatch) -> None:
    """Report a batch to the callback, if there is one."""
    if on_progress is not None:
        on_progress(batch)


async def notify_async(on_progress: AsyncOnProgress | None, batch: TileBatch) -> None:
    """Report a batch to the callback, if there is one, and await it."""
    if on_progress is not None and (pending := on_progress(batch)) is not None:
        await pending


@contextmanager
def leaving(job_id: str) -> Iterator[None]:
    """Note in the exception of Ctrl-C or of a cancelled task that the job keeps running."""
    try:
        yield
    except GeneratorExit:
        raise
    except BaseException as error:
        if not isinstance(error, Exception):
            error.add_note(f"Job {job_id} continues: only the waiting has ended. {what_next(job_id)}")
        raise


def succeeded(job: AnyJob) -> AnyJob:
    """Return a job that has not failed, been cancelled or expired; raise for any other.

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
