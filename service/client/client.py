"""The synchronous client."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import httpx2
import numpy as np
import numpy.typing as npt
import stamina

from schemas.comparisons import ComparisonAnswer
from schemas.convergence import Convergence
from schemas.errors import SceneError
from schemas.jobs import Job, JobList, JobState, TileBatch, TileEvent, Version
from schemas.plans import PlanDocument
from schemas.quotes import Quote
from schemas.traces import TraceAnswer
from service.client import calls
from service.client.batches import Encoding, PixelBatch
from service.client.calls import Answer, Call
from service.client.comparing import PictureSource, sent
from service.client.errors import (
    JobCancelledError,
    JobFailedError,
    RequestInvalidError,
    TimedOutError,
)
from service.client.exchange import check, checked_address, repeat_after, transport_errors
from service.client.parcels import Parcel, SceneSource, pack
from service.client.pictures import Picture, PictureKind

if TYPE_CHECKING:
    from renderer.assets import AssetSource

DEFAULT_SERVER = "http://127.0.0.1:8000"
LONGEST_HOLD = 20.0


class Client:
    """Talks to one service.

    Parameters
    ----------
    server
        Its address, such as ``http://127.0.0.1:8000``.
    timeout
        Seconds that the server may be silent; where the request asks it to hold its answer, that time
        comes on top.
    patience
        Seconds over which a request is repeated when the connection breaks or the server is too busy.
        Only requests that may safely be sent twice are repeated; 0 repeats none.

    Raises
    ------
    UnreachableError
        The address cannot be that of a server.

    Examples
    --------
    >>> with Client("http://127.0.0.1:8000") as client:  # doctest: +SKIP
    ...     job = client.submit("scene.json")
    ...     client.wait(job.id, on_progress=lambda batch: print(batch.progress.share))
    ...     pixels = client.pixels(job.id)
    """

    def __init__(self, server: str = DEFAULT_SERVER, *, timeout: float = 30.0, patience: float = 5.0) -> None:
        self.server = checked_address(server)
        self._timeout = timeout
        self._patience = patience
        self._http = httpx2.Client(base_url=server, timeout=timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def submit(
        self,
        scene: SceneSource,
        *,
        quality: Mapping[str, Any] | None = None,
        layers: Iterable[str] = (),
        assets: AssetSource | None = None,
        wait: float = 0.0,
    ) -> Job:
        """Ask for a render; local textures are uploaded first, each once.

        Parameters
        ----------
        scene
            The path of a scene file, its bytes, or its document as a dict.
        assets
            Where its textures are looked up; by default in the folder of the scene file and nowhere else.
        quality
            Overrides the scene's ``sampling``.
        layers
            What to tell about each pixel beside its colour, such as ``depth``.
        wait
            Seconds to wait for the end before the answer comes, whatever the state is then.

        Raises
        ------
        schemas.errors.SceneError
            The file is not JSON, or names a texture that is not there.
        RequestInvalidError
            The service refused the scene; `errors` has each reason with its pointer.
        """
        parcel = self._upload(pack(scene, assets=assets))
        with _placing(parcel):
            call = calls.submit_job(_body(parcel, quality, layers), wait=wait)
            job = self._send(call)
        return job.model_copy(update={"warnings": tuple(parcel.placed(job.warnings))})

    def get(self, job_id: str) -> Job:
        """The job as it is now."""
        return self._send(calls.get_job(job_id))

    def list(self, *, limit: int = 20, cursor: str | None = None) -> JobList:
        """One page of jobs, newest first; its ``next`` is the cursor of the page after."""
        return self._send(calls.list_jobs(limit=limit, cursor=cursor))

    def cancel(self, job_id: str) -> Job:
        """Stop a job; one that has ended stays as it is."""
        return self._send(calls.cancel_job(job_id))

    def delete(self, job_id: str) -> None:
        """Remove a job and its image."""
        self._send(calls.delete_job(job_id))

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

        A batch may be empty: it tells that the job is still there. A job that failed or was cancelled
        ends like any other; the last batch has its state.

        Raises
        ------
        TimedOutError
            `timeout` seconds have passed.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            hold = LONGEST_HOLD if deadline is None else min(LONGEST_HOLD, deadline - time.monotonic())
            batch = self.tiles(job_id, after=after, wait=max(hold, 0.0))
            yield batch
            after = batch.next
            if batch.complete:
                return
            if deadline is not None and time.monotonic() >= deadline:
                raise TimedOutError(f"Job {job_id} goes on after {timeout:g} s of waiting.", job_id=job_id)

    def wait(
        self,
        job_id: str,
        *,
        timeout: float | None = None,
        on_progress: Callable[[TileBatch], None] | None = None,
    ) -> Job:
        """Wait until the image is complete.

        Raises
        ------
        JobFailedError, JobCancelledError
            There will be no image.
        TimedOutError
            `timeout` seconds have passed; the job goes on.
        """
        for batch in self.follow(job_id, timeout=timeout):
            if on_progress is not None:
                on_progress(batch)
        return succeeded(self.get(job_id))

    def events(self, job_id: str, *, after: int = 0) -> Iterator[TileEvent]:
        """Tile events as a stream that the server pushes, until the job has ended or the connection breaks.

        Start again with the last number seen as `after` to go on where it broke.
        """
        call = calls.get_events(job_id, after=after)
        with (
            transport_errors(self.server, job_id=job_id),
            self._http.stream(call.method, call.path, headers=dict(call.headers)) as answer,
        ):
            if not answer.is_success:
                answer.read()
            yield from call.read(check(answer, call))

    def picture(self, job_id: str, kind: PictureKind = "png") -> Picture:
        """The image file, or what there is of it while the job is running."""
        return self._send(calls.get_picture(job_id, kind))

    def pixels(self, job_id: str) -> npt.NDArray[np.float32]:
        """The image as linear RGB, shape (height, width, 3), float32, row 0 at the top."""
        return self.picture(job_id, "npy").array()

    def layer_file(self, job_id: str, name: str) -> Picture:
        """A layer that the job was asked for, as a file, or what there is of it while the job is running."""
        return self._send(calls.get_layer(job_id, name))

    def layer(self, job_id: str, name: str) -> npt.NDArray[Any]:
        """A layer as an array, (height, width) or (height, width, channels), float32 or int32."""
        return self.layer_file(job_id, name).array()

    def plan(self, job_id: str) -> PlanDocument:
        """What runs for a job, and who asked."""
        return self._send(calls.get_plan(job_id))

    def convergence(self, job_id: str) -> Convergence:
        """What the passes of a job have cost, which error they left, and how fast it falls."""
        return self._send(calls.get_convergence(job_id))

    def convergence_file(self, job_id: str, form: str = "csv") -> bytes:
        """The same as a file.

        Parameters
        ----------
        form
            `json`, `csv`, or `svg` or `png` for a plot.
        """
        return self._send(calls.get_convergence_file(job_id, form))

    def explain(
        self, scene: SceneSource, *, quality: Mapping[str, Any] | None = None, layers: Iterable[str] = ()
    ) -> PlanDocument:
        """What would run for a scene; renders nothing."""
        parcel = self._upload(pack(scene))
        with _placing(parcel):
            return self._send(calls.make_plan(_body(parcel, quality, layers)))

    def quote(
        self,
        scene: SceneSource,
        *,
        quality: Mapping[str, Any] | None = None,
        target_error: float | None = None,
        seconds: float | None = None,
    ) -> Quote:
        """What a scene would cost, and how far off it would be, at several qualities.

        Parameters
        ----------
        quality
            What is priced first, in place of the scene's ``sampling``.
        target_error
            A wished error; ``for_error`` of the answer reaches it soonest.
        seconds
            A given time; ``for_seconds`` of the answer comes closest in it.

        Raises
        ------
        BusyError
            The service makes as many quotes as it may already.
        """
        wishes = {"target_error": target_error, "seconds": seconds}
        parcel = self._upload(pack(scene))
        with _placing(parcel):
            body = _body(parcel, quality) | {name: wish for name, wish in wishes.items() if wish is not None}
            return self._send(calls.make_quote(body))

    def trace(self, scene: SceneSource, origins: npt.ArrayLike, directions: npt.ArrayLike) -> TraceAnswer:
        """What each ray hits first.

        Parameters
        ----------
        origins, directions
            Shape (rays, 3), finite.
        """
        rows = {
            "origins": np.asarray(origins, dtype=np.float64).tolist(),
            "directions": np.asarray(directions, dtype=np.float64).tolist(),
        }
        parcel = self._upload(pack(scene))
        with _placing(parcel):
            return self._send(calls.trace(_body(parcel, None) | rows))

    def compare(
        self,
        image: PictureSource,
        reference: PictureSource,
        *,
        encoding: str | None = None,
        reference_encoding: str | None = None,
        **options: Any,
    ) -> ComparisonAnswer:
        """Compare two pictures on the server; ``penumbra compare`` and ``renderer.comparison`` do it here.

        Parameters
        ----------
        image, reference
            ``job:ID``, the path of a PNG, NPY or EXR file, or its bytes.
        encoding, reference_encoding
            ``srgb`` or ``linear``; by default what files of that kind usually mean, which the answer tells.
        options
            ``tolerance``, ``max_bias``, ``limit``, ``flip`` and ``pictures``, as the request has them.

        Raises
        ------
        OSError
            A file cannot be read.
        RequestInvalidError
            The pictures cannot be compared; `errors` says why.
        """
        pictures = {"image": sent(image, encoding), "reference": sent(reference, reference_encoding)}
        return self._send(calls.make_comparison(pictures | options))

    def version(self) -> Version:
        """Which service this is."""
        return self._send(calls.get_version())

    def _upload(self, parcel: Parcel) -> Parcel:
        for sha256, content in parcel.contents.items():
            if not self._send(calls.has_asset(sha256)):
                self._send(calls.put_asset(sha256, content))
        return parcel

    def _send(self, call: Call[Answer]) -> Answer:
        again = stamina.RetryingCaller(
            attempts=None if self._patience > 0 else 1,
            timeout=self._patience or None,
            wait_initial=0.1,
            wait_max=1.0,
            wait_jitter=0.1,
        )
        return again(repeat_after(call, self._patience), self._send_once, call)

    def _send_once(self, call: Call[Answer]) -> Answer:
        with transport_errors(self.server, job_id=call.job_id):
            answer = self._http.request(
                call.method,
                call.path,
                params=dict(call.params),
                headers=dict(call.headers),
                content=call.content,
                timeout=self._timeout + call.hold,
            )
        return call.read(check(answer, call))


def _body(parcel: Parcel, quality: Mapping[str, Any] | None, layers: Iterable[str] = ()) -> dict[str, Any]:
    asked = {"quality": dict(quality) if quality else None, "layers": list(layers)}
    return {"scene": parcel.document} | {name: value for name, value in asked.items() if value}


@contextmanager
def _placing(parcel: Parcel) -> Iterator[None]:
    """Let a refusal speak of the user's own document, not of the body that was made from it."""
    try:
        yield
    except RequestInvalidError as error:
        if not error.errors:
            raise
        placed = SceneError(parcel.placed(error.errors), error.document.more)
        told = {"errors": placed.errors, "detail": str(placed)}
        raise RequestInvalidError(error.status, error.document.model_copy(update=told)) from error


def succeeded(job: Job) -> Job:
    """Give a job back that has ended well; raise what became of any other.

    Raises
    ------
    JobFailedError, JobCancelledError
        There will be no image.
    """
    if job.failure is not None:
        raise JobFailedError(job_id=job.id, failure=job.failure)
    if job.state is JobState.CANCELLED:
        raise JobCancelledError(job_id=job.id)
    return job
