# Generated from async_jobs.py by tools/generate_sync_client.py: edit that file, then run this script.
"""A job of the synchronous client: wait, watch, fetch, cancel, keep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy.typing as npt
from pydantic import PrivateAttr

from schemas.api.jobs import JobLog, TileBatch
from schemas.api.plans import Convergence, PlanDocument
from service.client.batches import Encoding, TilePixels
from service.client.errors import ClientError
from service.client.following import OnProgress, leaving, notify, succeeded
from service.client.known import KnownJob, live_card
from service.client.pictures import Picture, PictureKind, kind_of, write

if TYPE_CHECKING:
    import numpy as np
    from PIL.Image import Image

    from service.client.client import Client


class RemoteJob(KnownJob):
    """A job of the service, and what can be done with it.

    Methods that return the finished image wait for it.

    Examples
    --------
    >>> job = client.submit("scene.json")  # doctest: +SKIP
    >>> job.save("picture.png", timeout=60)  # doctest: +SKIP
    """

    _client: Client = PrivateAttr()

    def refresh(self) -> Self:
        """Update the job from the service."""
        return self._renewed(self._client.get(self.id))

    def wait(self, *, timeout: float | None = None, on_progress: OnProgress | None = None) -> Self:
        """Wait until the image is complete; a notebook shows it growing meanwhile.

        Parameters
        ----------
        timeout
            Seconds to wait at most; the job keeps running.
        on_progress
            Called with each batch of tile events; it may be a coroutine function where calls are awaited.

        Raises
        ------
        NoImageError
            There will be no image.
        TimedOutError
            `timeout` seconds have passed.
        """
        live = live_card()

        def note(batch: TileBatch) -> None:
            self._noted(batch)
            if live is not None and live.due(batch):
                live.show(self, self._preview())
            notify(on_progress, batch)

        return self._renewed(self._client.wait(self.id, timeout=timeout, on_progress=note))

    def cancel(self) -> Self:
        """Stop it; a job that has ended stays as it is."""
        return self._renewed(self._client.cancel(self.id))

    def pause(self) -> Self:
        """Pause it; a job that has ended stays as it is."""
        return self._renewed(self._client.pause(self.id))

    def resume(self) -> Self:
        """Resume it, if it is paused."""
        return self._renewed(self._client.resume(self.id))

    def delete(self) -> None:
        """Remove it and its image."""
        self._client.delete(self.id)

    def pin(self) -> Self:
        """Keep its picture until it is unpinned or deleted."""
        return self._renewed(self._client.pin(self.id))

    def unpin(self) -> Self:
        """Let its picture expire again."""
        return self._renewed(self._client.unpin(self.id))

    def image(self, *, timeout: float | None = None) -> npt.NDArray[np.float32]:
        """The finished image as linear RGB, shape (height, width, 3), float32, row 0 at the top."""
        picture = self._finished("npy", timeout)
        return picture.array()

    def pillow(self, *, timeout: float | None = None) -> Image:
        """The finished image for Pillow, RGB with 8 bits as displayed."""
        picture = self._finished("png", timeout)
        return picture.pillow()

    def save(self, path: str | PathLike[str], *, timeout: float | None = None) -> Path:
        """Write the finished image to a file, in one step.

        Parameters
        ----------
        path
            Ends in ``.png``, ``.npy`` for linear float32, or ``.exr`` for that with all layers.

        Raises
        ------
        ValueError
            It has another ending.
        """
        picture = self._finished(kind_of(path), timeout)
        return write(path, picture.content)

    @property
    def layers(self) -> Mapping[str, npt.NDArray[Any]]:
        """The requested layers by name; each is fetched, and waited for, when it is used."""
        return Layers(self)

    def picture(self, kind: PictureKind = "png") -> Picture:
        """The image file, or the finished part of it."""
        return self._client.picture(self.id, kind)

    def tiles(self, *, timeout: float | None = None, encoding: Encoding = "float32") -> Iterator[TilePixels]:
        """Tiles with pixels as they finish, the preview first; later tiles replace earlier ones.

        Raises
        ------
        NoImageError
            There will be no image.
        TimedOutError
            `timeout` seconds have passed.
        """
        with leaving(self.id):
            for batch in self._client.follow_pixels(self.id, timeout=timeout, encoding=encoding):
                yield from batch.tiles
            succeeded(self.refresh())

    def plan(self) -> PlanDocument:
        """Its plan: what runs, and which parts of the scene require it."""
        return self._client.plan(self.id)

    def convergence(self) -> Convergence:
        """The cost and error of each pass, and how fast the error falls."""
        return self._client.convergence(self.id)

    def log(self) -> JobLog:
        """Its history: states, passes, retried tiles, lost workers, failures."""
        return self._client.log(self.id)

    def _finished(self, kind: PictureKind, timeout: float | None) -> Picture:
        if not self._has_image:
            self.wait(timeout=timeout)
        return self.picture(kind)

    def _preview(self) -> bytes | None:
        """A PNG of the finished part, or None."""
        try:
            return self._client.preview(self.id)
        except ClientError:
            return None


class Layers(Mapping[str, npt.NDArray[Any]]):
    """The layers of a job as arrays, (height, width) or (height, width, channels), float32 or int32."""

    def __init__(self, job: RemoteJob) -> None:
        self._job = job

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self._job.links.layers:
            raise KeyError(f"The layer {name!r} was not requested for this job, only {list(self)}.")
        return self._fetched(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._job.links.layers)

    def __len__(self) -> int:
        return len(self._job.links.layers)

    def _fetched(self, name: str) -> npt.NDArray[Any]:
        if not self._job.done:
            self._job.wait()
        return self._job._client.layer(self._job.id, name)  # noqa: SLF001
