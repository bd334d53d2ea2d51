"""The asynchronous client: the same calls and flows, awaited."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy.typing as npt
from anyio import to_thread

from schemas.comparisons import ComparisonAnswer
from schemas.convergence import Convergence
from schemas.jobs import JobList, TileBatch, TileEvent, Version
from schemas.logs import JobLog
from schemas.plans import PlanDocument
from schemas.quality import Quality
from schemas.quotes import Quote
from schemas.retention import Pruned
from schemas.traces import TraceAnswer
from service.client import calls, flows
from service.client.async_connection import AsyncConnection
from service.client.async_jobs import AsyncRemoteJob
from service.client.batches import Encoding, PixelBatch
from service.client.comparing import PictureSource, sent
from service.client.documents import sendable
from service.client.events import tile_event
from service.client.following import Following, leaving, succeeded
from service.client.parcels import Parcel, SceneSource, pack
from service.client.pictures import Picture, PictureKind
from service.client.rays import rows

if TYPE_CHECKING:
    import numpy as np

    from service.client.parcels import Assets


class AsyncClient(AsyncConnection):
    """What :class:`Client` is, for asynchronous programs; parameters and errors are the same.

    A task that is cancelled closes the connection that it waited on. The job goes on.

    Examples
    --------
    >>> async with AsyncClient() as client:  # doctest: +SKIP
    ...     job = await client.submit("scene.json")
    ...     async for tile in job.tiles():
    ...         tile.paint(canvas)
    """

    async def submit(  # noqa: PLR0913 - one argument for each member of the request
        self,
        scene: SceneSource,
        *,
        quality: Quality | Mapping[str, Any] | None = None,
        layers: Iterable[str] = (),
        labels: Mapping[str, str] | None = None,
        priority: int | None = None,
        time_limit: float | None = None,
        assets: Assets | None = None,
        wait: float = 0.0,
        idempotency_key: str | None = None,
        anew: bool = False,
    ) -> AsyncRemoteJob:
        """Ask for a render; local textures are uploaded first, each once."""
        wishes = flows.wishes(
            quality=quality, layers=layers, labels=labels, priority=priority, time_limit=time_limit
        )
        parcel = await _packed(scene, assets)
        flow = flows.submission(parcel, wishes, wait=wait, key=idempotency_key, anew=anew)
        return AsyncRemoteJob.of(await self._run(flow), self)

    async def get(self, job_id: str) -> AsyncRemoteJob:
        """The job as it is now."""
        return AsyncRemoteJob.of(await self._send(calls.get_job(job_id)), self)

    async def list(
        self,
        *,
        limit: int = 20,
        cursor: str | None = None,
        state: str | None = None,
        labels: Mapping[str, str] | None = None,
    ) -> JobList:
        """One page of jobs in a state and with labels, newest first; ``next`` is the cursor of the next."""
        return await self._send(calls.list_jobs(limit=limit, cursor=cursor, state=state, labels=labels))

    async def jobs(
        self, *, state: str | None = None, labels: Mapping[str, str] | None = None
    ) -> AsyncIterator[AsyncRemoteJob]:
        """All jobs in a state and with labels, newest first; pages are fetched as they are needed."""
        cursor: str | None = None
        while True:
            page = await self.list(limit=calls.LONGEST_PAGE, cursor=cursor, state=state, labels=labels)
            for job in page.jobs:
                yield AsyncRemoteJob.of(job, self)
            if (cursor := page.next) is None:
                return

    async def cancel(self, job_id: str) -> AsyncRemoteJob:
        """Stop a job; one that has ended stays as it is."""
        return AsyncRemoteJob.of(await self._send(calls.cancel_job(job_id)), self)

    async def pause(self, job_id: str) -> AsyncRemoteJob:
        """Let a job stand still: no more of its tiles are handed out; one that has ended stays as it is."""
        return AsyncRemoteJob.of(await self._send(calls.pause_job(job_id)), self)

    async def resume(self, job_id: str) -> AsyncRemoteJob:
        """Let a job go on that stands still; any other stays as it is."""
        return AsyncRemoteJob.of(await self._send(calls.resume_job(job_id)), self)

    async def delete(self, job_id: str) -> None:
        """Remove a job and its image."""
        await self._send(calls.delete_job(job_id))

    async def pin(self, job_id: str) -> AsyncRemoteJob:
        """Keep the picture of a job until it is unpinned or deleted.

        Raises
        ------
        NotAllowedError
            As many are pinned as may be.
        """
        return AsyncRemoteJob.of(await self._send(calls.pin_job(job_id, pinned=True)), self)

    async def unpin(self, job_id: str) -> AsyncRemoteJob:
        """Let the picture of a job go when its time has come."""
        return AsyncRemoteJob.of(await self._send(calls.pin_job(job_id, pinned=False)), self)

    async def prune(
        self,
        *,
        keep_seconds: float | None = None,
        max_stored_bytes: int | None = None,
        keep_asset_seconds: float | None = None,
        dry_run: bool = True,
    ) -> Pruned:
        """What the service would let go by these rules, or by its own; with ``dry_run=False`` it does.

        Raises
        ------
        NotAllowedError
            The key is not that of an admin.
        """
        rules = flows.wishes(
            keep_seconds=keep_seconds,
            max_stored_bytes=max_stored_bytes,
            keep_asset_seconds=keep_asset_seconds,
            dry_run=dry_run,
        )
        return await self._send(calls.prune(rules))

    async def tiles(self, job_id: str, *, after: int = 0, wait: float = 0.0) -> TileBatch:
        """The tile events numbered above `after`; waits up to `wait` seconds for the first."""
        return await self._send(calls.get_tiles(job_id, after=after, wait=wait))

    async def tile_pixels(
        self, job_id: str, *, after: int = 0, wait: float = 0.0, encoding: Encoding = "float32"
    ) -> PixelBatch:
        """The same with the pixels of these tiles, linear float32 or displayed 8 bits."""
        return await self._send(calls.get_tile_pixels(job_id, after=after, wait=wait, encoding=encoding))

    async def follow(
        self, job_id: str, *, after: int = 0, timeout: float | None = None
    ) -> AsyncIterator[TileBatch]:
        """Batches of tile events as they come, until the job has ended."""
        place = Following(job_id, after, timeout)
        more = True
        while more:
            batch = await self.tiles(job_id, after=place.after, wait=place.hold)
            yield batch
            more = place.goes_on(batch)

    async def follow_pixels(
        self,
        job_id: str,
        *,
        after: int = 0,
        timeout: float | None = None,
        encoding: Encoding = "float32",
    ) -> AsyncIterator[PixelBatch]:
        """The same with the pixels of the tiles."""
        place = Following(job_id, after, timeout)
        more = True
        while more:
            batch = await self.tile_pixels(job_id, after=place.after, wait=place.hold, encoding=encoding)
            yield batch
            more = place.goes_on(batch)

    async def wait(
        self,
        job_id: str,
        *,
        timeout: float | None = None,
        on_progress: Callable[[TileBatch], Awaitable[None] | None] | None = None,
    ) -> AsyncRemoteJob:
        """Wait until the image is complete; `on_progress` may be a coroutine function."""
        with leaving(job_id):
            async for batch in self.follow(job_id, timeout=timeout):
                if on_progress is not None and (told := on_progress(batch)) is not None:
                    await told
            return succeeded(await self.get(job_id))

    async def events(self, job_id: str, *, after: int = 0) -> AsyncIterator[TileEvent]:
        """Tile events as a stream that the server pushes.

        To leave it early, go through it in ``contextlib.aclosing``: that closes the connection.
        """
        async with self._stream(calls.get_events(job_id, after=after)) as events:
            async for event in events:
                if (found := tile_event(event)) is not None:
                    yield found

    async def picture(self, job_id: str, kind: PictureKind = "png") -> Picture:
        """The image file, or what there is of it while the job is running."""
        return await self._send(calls.get_picture(job_id, kind))

    async def glimpse(self, job_id: str) -> bytes | None:
        """What there is to see of a job, the bytes of a PNG file; None before its first tile."""
        return await self._send(calls.get_glimpse(job_id))

    async def pixels(self, job_id: str) -> npt.NDArray[np.float32]:
        """The image as linear RGB, shape (height, width, 3), float32, row 0 at the top."""
        return (await self.picture(job_id, "npy")).array()

    async def layer_file(self, job_id: str, name: str) -> Picture:
        """A layer that the job was asked for, as a file, or what there is of it while the job is running."""
        return await self._send(calls.get_layer(job_id, name))

    async def layer(self, job_id: str, name: str) -> npt.NDArray[Any]:
        """A layer as an array, (height, width) or (height, width, channels), float32 or int32."""
        return (await self.layer_file(job_id, name)).array()

    async def plan(self, job_id: str) -> PlanDocument:
        """What runs for a job, and who asked."""
        return await self._send(calls.get_plan(job_id))

    async def convergence(self, job_id: str) -> Convergence:
        """What the passes of a job have cost, which error they left, and how fast it falls."""
        return await self._send(calls.get_convergence(job_id))

    async def convergence_file(self, job_id: str, form: str = "csv") -> bytes:
        """The same as a file: `json`, `csv`, or `svg` or `png` for a plot."""
        return await self._send(calls.get_convergence_file(job_id, form))

    async def log(self, job_id: str) -> JobLog:
        """What became of a job: states, passes, repeated tiles, workers lost, failures."""
        return await self._send(calls.get_log(job_id))

    async def explain(
        self,
        scene: SceneSource,
        *,
        quality: Quality | Mapping[str, Any] | None = None,
        layers: Iterable[str] = (),
    ) -> PlanDocument:
        """What would run for a scene; renders nothing."""
        wishes = flows.wishes(quality=quality, layers=layers)
        return await self._run(flows.plan(await _packed(scene), wishes))

    async def quote(
        self,
        scene: SceneSource,
        *,
        quality: Quality | Mapping[str, Any] | None = None,
        target_error: float | None = None,
        seconds: float | None = None,
    ) -> Quote:
        """What a scene would cost, and how far off it would be, at several qualities."""
        wishes = flows.wishes(quality=quality, target_error=target_error, seconds=seconds)
        return await self._run(flows.quote(await _packed(scene), wishes))

    async def trace(
        self, scene: SceneSource, origins: npt.ArrayLike, directions: npt.ArrayLike
    ) -> TraceAnswer:
        """What each ray hits first."""
        return await self._run(flows.traces(await _packed(scene), rows(origins, directions)))

    async def compare(
        self,
        image: PictureSource,
        reference: PictureSource,
        *,
        encoding: str | None = None,
        reference_encoding: str | None = None,
        **options: Any,
    ) -> ComparisonAnswer:
        """Compare two pictures on the server."""
        pictures = {
            "image": await to_thread.run_sync(sent, image, encoding),
            "reference": await to_thread.run_sync(sent, reference, reference_encoding),
        }
        return await self._send(calls.make_comparison(pictures | sendable(options)))

    async def version(self) -> Version:
        """Which service this is."""
        return await self._send(calls.get_version())


async def _packed(scene: SceneSource, assets: Assets | None = None) -> Parcel:
    """Read and hash the files of a scene where that keeps nobody waiting."""
    return await to_thread.run_sync(partial(pack, scene, assets=assets))
