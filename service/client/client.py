# Generated from async_client.py by tools/generate_sync_client.py: edit that file, then run this script.
"""The synchronous client."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from schemas.api.comparisons import ComparisonAnswer
from schemas.api.inspections import TraceAnswer
from schemas.api.jobs import Job, JobList, JobLog, TileBatch, TileEvent, Version
from schemas.api.plans import Convergence, PlanDocument, Quote
from schemas.api.request_pointers import in_scene
from schemas.quality import Quality
from service.client import calls, flows
from service.client.batches import Encoding, PixelBatch
from service.client.comparing import PictureSource, sent
from service.client.following import Following, OnProgress, leaving, notify, succeeded
from service.client.jobs import RemoteJob
from service.client.operations import Operations
from service.client.parcels import SceneSource, pack, rows
from service.client.pictures import Picture, PictureKind

if TYPE_CHECKING:
    import numpy as np

    from service.client.parcels import Assets


class Client(Operations):
    """Talks to one service. Leaving early, by Ctrl-C or by cancelling a task, never stops a job.

    Parameters
    ----------
    server
        Its address; by default that in ``PENUMBRA_SERVER``, else ``http://127.0.0.1:8000``.
    key
        The API key, where the service needs one; by default that in ``PENUMBRA_KEY``.
    timeout
        Seconds that the server may be silent, beyond those that a request asks it to hold its answer; None is
        for ever.
    retry_seconds
        Seconds over which a request is repeated when the connection breaks or the server is too busy.
        Only requests that may safely be sent twice are repeated; 0 repeats none, None for ever.

    Raises
    ------
    UnreachableError
        The address cannot be that of a server.

    Examples
    --------
    >>> with Client("http://127.0.0.1:8000") as client:  # doctest: +SKIP
    ...     job = client.submit("scene.json")
    ...     job.wait(on_progress=lambda batch: print(batch.progress.share))
    ...     pixels = job.image()
    """

    def submit(  # noqa: PLR0913 - one argument for each member of the request
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
    ) -> RemoteJob:
        """Ask for a render; local textures are uploaded first, each once.

        Parameters
        ----------
        scene
            The path of a scene file, its bytes, its document as a dict, or a `schemas.Scene`. A dict may have
            arrays and numbers of NumPy.
        assets
            Folder where its textures and meshes are looked up, or an ``AssetSource``; by default that of the
            scene file, and nowhere for other sources.
        quality
            Overrides the scene's ``sampling``: a dict, or `schemas.FixedQuality` or `schemas.TargetQuality`.
        layers
            Values to record of each pixel beside its colour, such as ``depth``.
        labels
            Names and values by which the job is found again.
        priority
            Of your own jobs those of a higher priority run first.
        time_limit
            Seconds after its start at which an unfinished job ends.
        wait
            Seconds that the answer may be held back for the job to end.
        idempotency_key
            The same request with the same key is the same job; by default each call has a new key.
        anew
            Render it even if the service has the same picture already.

        Raises
        ------
        schemas.errors.SceneError
            The file is not JSON, or names a texture that is not there.
        RequestInvalidError
            The service refused the scene; `errors` has each reason with its pointer.
        """
        members = flows.given(
            quality=quality, layers=layers, labels=labels, priority=priority, time_limit=time_limit
        )
        parcel = pack(scene, assets)
        flow = flows.submission(parcel, members, wait=wait, key=idempotency_key, anew=anew)
        return RemoteJob.of(self._run(flow), self)

    def get(self, job_id: str) -> RemoteJob:
        """The job as it is now."""
        return self._job(job_id)

    def list(
        self,
        *,
        limit: int = 20,
        cursor: str | None = None,
        state: str | None = None,
        labels: calls.Labels | None = None,
        search: str | None = None,
    ) -> JobList:
        """One page of jobs, newest first; ``next`` is the cursor of the next.

        Parameters
        ----------
        state, labels
            Only jobs in this state, with a value of each label.
        search
            Only jobs with this text in their name or in a label ``name:value``.
        """
        found = calls.list_jobs(limit=limit, cursor=cursor, state=state, labels=labels, search=search)
        return self._send(found)

    def jobs(
        self, *, state: str | None = None, labels: calls.Labels | None = None, search: str | None = None
    ) -> Iterator[RemoteJob]:
        """All jobs that `list` finds, newest first; pages are fetched when needed."""
        limit, cursor = calls.LONGEST_PAGE, None
        while True:
            page = self.list(limit=limit, cursor=cursor, state=state, labels=labels, search=search)
            for job in page.jobs:
                yield RemoteJob.of(job, self)
            if (cursor := page.next) is None:
                return

    def cancel(self, job_id: str) -> RemoteJob:
        """Stop a job; a job that has ended stays as it is."""
        return self._job(job_id, "/cancel", "POST")

    def pause(self, job_id: str) -> RemoteJob:
        """Pause a job: no more of its tiles are started; a job that has ended stays as it is."""
        return self._job(job_id, "/pause", "POST")

    def resume(self, job_id: str) -> RemoteJob:
        """Resume a paused job; other jobs stay as they are."""
        return self._job(job_id, "/resume", "POST")

    def delete(self, job_id: str) -> None:
        """Remove a job and its image."""
        self._send(calls.delete_job(job_id))

    def pin(self, job_id: str) -> RemoteJob:
        """Keep the picture of a job until it is unpinned or deleted.

        Raises
        ------
        NotAllowedError
            The limit of pinned jobs is reached.
        """
        return self._job(job_id, "/pin", "PUT")

    def unpin(self, job_id: str) -> RemoteJob:
        """Let the picture of a job expire again."""
        return self._job(job_id, "/pin", "DELETE")

    def tiles(self, job_id: str, *, after: int = 0, wait: float = 0.0) -> TileBatch:
        """The tile events numbered above `after`; waits up to `wait` seconds for the first."""
        return self._send(calls.get_tiles(job_id, after=after, wait=wait))

    def tile_pixels(
        self, job_id: str, *, after: int = 0, wait: float = 0.0, encoding: Encoding = "float32"
    ) -> PixelBatch:
        """The same with the pixels of these tiles, linear float32 or displayed 8 bits."""
        return self._send(calls.get_tile_pixels(job_id, after=after, wait=wait, encoding=encoding))

    def follow(self, job_id: str, *, after: int = 0, timeout: float | None = None) -> Iterator[TileBatch]:
        """Batches of tile events as they come, until the job has ended.

        A batch may be empty. A job that failed or was cancelled ends like any other; the last batch has
        its state.

        Raises
        ------
        TimedOutError
            `timeout` seconds have passed.
        """
        place = Following(job_id, after, timeout)
        while place.more:
            batch = self.tiles(job_id, after=place.after, wait=place.hold)
            yield batch
            place.advance(batch)

    def follow_pixels(
        self, job_id: str, *, after: int = 0, timeout: float | None = None, encoding: Encoding = "float32"
    ) -> Iterator[PixelBatch]:
        """The same with the pixels of the tiles."""
        place = Following(job_id, after, timeout)
        while place.more:
            batch = self.tile_pixels(job_id, after=place.after, wait=place.hold, encoding=encoding)
            yield batch
            place.advance(batch)

    def wait(
        self, job_id: str, *, timeout: float | None = None, on_progress: OnProgress | None = None
    ) -> RemoteJob:
        """Wait until the image is complete. Leaving early ends the waiting, not the job.

        Raises
        ------
        NoImageError
            There will be no image.
        TimedOutError
            `timeout` seconds have passed; the job keeps running.
        """
        with leaving(job_id):
            for batch in self.follow(job_id, timeout=timeout):
                notify(on_progress, batch)
            return succeeded(self.get(job_id))

    def events(self, job_id: str, *, after: int = 0) -> Iterator[TileEvent]:
        """Tile events as a stream that the server pushes, until the job has ended or the connection breaks.

        To resume, give the last number seen as `after`. To leave it early, go through it in
        ``contextlib.closing``: that closes the connection.
        """
        with self._stream(calls.get_events(job_id, after=after)) as events:
            for event in events:
                if (found := calls.tile_event(event)) is not None:
                    yield found

    def picture(self, job_id: str, kind: PictureKind = "png") -> Picture:
        """The image file, or while the job runs the finished part of it."""
        return self._send(calls.get_picture(job_id, f"image.{kind}"))

    def preview(self, job_id: str) -> bytes | None:
        """The finished part of a job's picture as a PNG file; None before its first tile."""
        return self._send(calls.get_preview(job_id))

    def pixels(self, job_id: str) -> npt.NDArray[np.float32]:
        """The image as linear RGB, shape (height, width, 3), float32, row 0 at the top."""
        return (self.picture(job_id, "npy")).array()

    def layer_file(self, job_id: str, name: str) -> Picture:
        """Get a requested layer as a file; while the job runs, the finished part of it."""
        return self._send(calls.get_picture(job_id, "layers", f"{name}.npy"))

    def layer(self, job_id: str, name: str) -> npt.NDArray[Any]:
        """A layer as an array, (height, width) or (height, width, channels), float32 or int32."""
        return (self.layer_file(job_id, name)).array()

    def plan(self, job_id: str) -> PlanDocument:
        """The plan of a job: what runs, and which parts of the scene require it."""
        return in_scene(self._send(calls.about(job_id, "/plan", PlanDocument)))

    def convergence(self, job_id: str) -> Convergence:
        """The cost and error of each pass of a job, and how fast the error falls."""
        return self._send(calls.about(job_id, "/convergence", Convergence))

    def convergence_file(self, job_id: str, form: str = "csv") -> bytes:
        """The same as a file: `json`, `csv`, or `svg` or `png` for a plot."""
        return self._send(calls.get_convergence_file(job_id, form))

    def log(self, job_id: str) -> JobLog:
        """The history of a job: states, passes, retried tiles, lost workers, failures."""
        return self._send(calls.about(job_id, "/log", JobLog))

    def explain(
        self,
        scene: SceneSource,
        *,
        quality: Quality | Mapping[str, Any] | None = None,
        layers: Iterable[str] = (),
    ) -> PlanDocument:
        """The plan of a scene; nothing is rendered."""
        members = flows.given(quality=quality, layers=layers)
        return in_scene(self._about_scene(scene, "/v1/plans", members, PlanDocument))

    def quote(
        self,
        scene: SceneSource,
        *,
        quality: Quality | Mapping[str, Any] | None = None,
        target_error: float | None = None,
        seconds: float | None = None,
    ) -> Quote:
        """The predicted seconds and error of a scene at several qualities.

        Parameters
        ----------
        quality
            Priced besides, in place of the scene's ``sampling``.
        target_error
            ``for_error`` of the answer reaches it soonest.
        seconds
            ``for_seconds`` of the answer has the smallest error in this time.

        Raises
        ------
        BusyError
            The service is at its limit of concurrent quotes.
        """
        members = flows.given(quality=quality, target_error=target_error, seconds=seconds)
        return in_scene(self._about_scene(scene, "/v1/quotes", members, Quote))

    def trace(self, scene: SceneSource, origins: npt.ArrayLike, directions: npt.ArrayLike) -> TraceAnswer:
        """First hit of each ray.

        Parameters
        ----------
        origins, directions
            Shape (rays, 3), finite.
        """
        return self._about_scene(scene, "/v1/traces", rows(origins, directions), TraceAnswer)

    def compare(
        self,
        image: PictureSource,
        reference: PictureSource,
        *,
        encoding: str | None = None,
        reference_encoding: str | None = None,
        **options: Any,
    ) -> ComparisonAnswer:
        """Compare two pictures on the server; ``penumbra compare`` and ``accuracy.comparison`` do it here.

        Parameters
        ----------
        image, reference
            A job or ``job:ID``; the path of a PNG, NPY or EXR file, or its bytes; an array (H, W, 3); or an
            image of Pillow.
        encoding, reference_encoding
            ``srgb`` or ``linear``; by default what files of that kind usually mean.
        options
            ``tolerance``, ``max_bias``, ``limit``, ``flip`` and ``pictures``, as the request has them.

        Raises
        ------
        OSError
            A file cannot be read.
        TypeError
            It is none of these.
        RequestInvalidError
            The pictures cannot be compared; `errors` says why.
        """
        pictures = {
            "image": sent(image, encoding),
            "reference": sent(reference, reference_encoding),
        }
        return self._run(flows.comparison(pictures, options))

    def version(self) -> Version:
        """The version of the service."""
        return self._send(calls.ask("/version", Version))

    def _job(self, job_id: str, part: str = "", method: str = "GET") -> RemoteJob:
        return RemoteJob.of(self._send(calls.about(job_id, part, Job, method)), self)

    def _about_scene(
        self, scene: SceneSource, path: str, members: Mapping[str, Any], model: type[calls.Model]
    ) -> calls.Model:
        parcel = pack(scene)
        return self._run(flows.about_scene(parcel, path, members, model))
