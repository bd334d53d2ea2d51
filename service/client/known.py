"""The last known state of a job, and its card in notebooks: a bar and the picture so far."""

from __future__ import annotations

import base64
import sys
import time
from dataclasses import dataclass
from html import escape
from typing import Any, Self

from pydantic import PrivateAttr

from schemas.api.jobs import Job, JobState, TileBatch
from service.client.pictures import PNG

SECONDS_BETWEEN_PICTURES = 1.0
"""Least seconds between two pictures of a card: the service encodes each, and a browser decodes it."""

CARD_PIXELS = 512
"""Pixels of a picture in a card; larger ones are shown smaller."""


def card(job: Job, picture: bytes | None) -> str:
    """A job in HTML: name and state, a bar, what went wrong, and the bytes of a PNG file as a picture."""
    name = f"<b>{escape(job.name)}</b> " if job.name else ""
    share = job.progress.share
    lines = [
        f"{name}{escape(job.id)}: {job.state}, {100 * share:.0f} % of {job.width} × {job.height} pixels",
        f'<progress value="{share:.4f}" max="1" style="width: {CARD_PIXELS}px; max-width: 100%"></progress>',
    ]
    if job.failure is not None:
        lines.append(f"{escape(job.failure.message)} ({escape(job.failure.code)})")
    if picture is not None and picture.startswith(PNG):
        data = base64.b64encode(picture).decode("ascii")
        lines.append(
            f'<img src="data:image/png;base64,{data}" style="max-width: min({CARD_PIXELS}px, 100%)">'
        )
    return "".join(f"<div>{line}</div>" for line in lines)


@dataclass(slots=True)
class LiveCard:
    """A place in a notebook's output that changes while a job runs."""

    handle: Any = None
    shown: float | None = None

    def due(self, batch: TileBatch) -> bool:
        """Whether the picture is to be shown again."""
        now = time.monotonic()
        return batch.complete or self.shown is None or now - self.shown >= SECONDS_BETWEEN_PICTURES

    def show(self, job: Job, picture: bytes | None) -> None:
        """Put the job's card in this place."""
        from IPython.display import HTML, display  # noqa: PLC0415 - there only where a notebook is

        self.shown = time.monotonic()
        page = HTML(card(job, picture))
        if self.handle is None:
            self.handle = display(page, display_id=True)
        else:
            self.handle.update(page)


def live_card() -> LiveCard | None:
    """A place to show progress, where this runs in a notebook; elsewhere None."""
    # A notebook has loaded IPython already; loading it elsewhere would be slow.
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return LiveCard() if getattr(shell, "kernel", None) is not None else None


class AsyncKnownJob(Job):
    """A job with its client; a notebook shows it as a card without a picture, which would have to be awaited.

    The fields of ``schemas.api.jobs.Job`` are as in the last answer; methods that ask the service update
    them.
    """

    _client: Any = PrivateAttr()

    @classmethod
    def of(cls, job: Job, client: Any) -> Self:
        """The same job with its client."""
        return cls.model_validate(dict(job), context=client)

    def model_post_init(self, context: Any) -> None:
        """Keep the client, which is not a field of the job."""
        self._client = context

    @property
    def done(self) -> bool:
        """Whether it had succeeded, failed or been cancelled at the last answer."""
        return self.state.final

    def __repr__(self) -> str:
        size = f"{self.width} x {self.height}"
        return f"<{type(self).__name__} {self.id}: {self.state}, {100 * self.progress.share:.0f} % of {size}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return card(self, None)

    def _renewed(self, newer: Job) -> Self:
        self.__dict__.update(newer.__dict__)
        return self

    def _noted(self, batch: TileBatch) -> None:
        self.__dict__.update(state=batch.state, progress=batch.progress, failure=batch.failure)

    @property
    def _has_image(self) -> bool:
        return self.state is JobState.SUCCEEDED


class KnownJob(AsyncKnownJob):
    """The same for a client that blocks: a notebook shows the picture so far too."""

    def _preview(self) -> bytes | None:
        raise NotImplementedError

    def _repr_html_(self) -> str:
        return card(self, self._preview())

    def _repr_png_(self) -> bytes | None:
        return self._preview()
