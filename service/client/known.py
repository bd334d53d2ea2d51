"""A job as its submitter holds it: what is known of it, kept up to date by each answer about it."""

from __future__ import annotations

from typing import Any, Self

from pydantic import PrivateAttr

from schemas.jobs import Job, JobState, TileBatch
from service.client import notebooks


class AsyncKnownJob(Job):
    """A job with its client; a notebook shows it as a card without a picture, which would have to be awaited.

    All that ``schemas.jobs.Job`` tells is there as it was last heard: methods that talk to the service
    bring it up to date.
    """

    _client: Any = PrivateAttr()

    @classmethod
    def of(cls, job: Job, client: Any) -> Self:
        """The same job, of which more can be asked."""
        return cls.model_validate(dict(job), context=client)

    def model_post_init(self, context: Any) -> None:
        """Keep the client, which is no part of what is known."""
        self._client = context

    @property
    def done(self) -> bool:
        """Whether it had succeeded, failed or been cancelled when it was last heard of."""
        return self.state.final

    def __repr__(self) -> str:
        size = f"{self.width} x {self.height}"
        return f"<{type(self).__name__} {self.id}: {self.state}, {self.progress.share:.0%} of {size}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return notebooks.card(self, None)

    def _renewed(self, newer: Job) -> Self:
        # Nobody else changes a job, and it is the same one: only more is known of it.
        self.__dict__.update(newer.__dict__)
        return self

    def _noted(self, batch: TileBatch) -> None:
        self.__dict__.update(state=batch.state, progress=batch.progress, failure=batch.failure)

    @property
    def _has_image(self) -> bool:
        return self.state is JobState.SUCCEEDED


class KnownJob(AsyncKnownJob):
    """The same for a client that blocks: a notebook shows the picture so far too."""

    def _seen(self) -> bytes | None:
        raise NotImplementedError

    def _repr_html_(self) -> str:
        return notebooks.card(self, self._seen())

    def _repr_png_(self) -> bytes | None:
        return self._seen()
