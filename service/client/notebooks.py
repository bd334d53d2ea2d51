"""Jobs in notebooks: a card with a bar and the picture so far. Needs nothing where there is no notebook."""

from __future__ import annotations

import base64
import sys
import time
from dataclasses import dataclass
from html import escape
from typing import Any

from schemas.jobs import Job, TileBatch
from service.client.pictures import PNG

SECONDS_BETWEEN_PICTURES = 1.0
"""A browser decodes each of them, and the service encodes it."""

WIDEST = 512
"""Pixels of a picture in a card; larger ones are shown smaller."""


def card(job: Job, picture: bytes | None) -> str:
    """A job in HTML: name and state, a bar, what went wrong, and the bytes of a PNG file as a picture."""
    name = f"<b>{escape(job.name)}</b> " if job.name else ""
    share = job.progress.share
    lines = [
        f"{name}{escape(job.id)}: {job.state}, {share:.0%} of {job.width} × {job.height} pixels",
        f'<progress value="{share:.4f}" max="1" style="width: {WIDEST}px; max-width: 100%"></progress>',
    ]
    if job.failure is not None:
        lines.append(f"{escape(job.failure.message)} ({escape(job.failure.code)})")
    if picture is not None and picture.startswith(PNG):
        data = base64.b64encode(picture).decode("ascii")
        lines.append(f'<img src="data:image/png;base64,{data}" style="max-width: min({WIDEST}px, 100%)">')
    return "".join(f"<div>{line}</div>" for line in lines)


@dataclass(slots=True)
class Live:
    """A place in a notebook's output that changes while a job runs."""

    handle: Any = None
    shown: float | None = None

    def due(self, batch: TileBatch) -> bool:
        """Whether the picture is to be shown anew."""
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


def live() -> Live | None:
    """A place to show progress, where this runs in a notebook; elsewhere None."""
    # Whoever runs in a notebook has loaded IPython already; to load it only for asking would be slow.
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return Live() if getattr(shell, "kernel", None) is not None else None
