"""Render scenes in this process or as jobs of a service, with the same pixels."""

from __future__ import annotations

import io
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from renderer import compile_scene, load_scene, render
from renderer.errors import RenderError, SceneError
from schemas.quality import FixedQuality, Quality
from schemas.scene import Scene
from service.grading.folders import Folder

if TYPE_CHECKING:
    from service.client import Client

RANDOM = frozenset({"random", "stratified", "sobol"})
"""Patterns whose layer `error` estimates noise; for a fixed grid it does not."""

SERVICE_SHARE = 0.8
"""Share of a deadline after which the job of a service is cancelled."""

SHOWN = 3
"""Problems of a scene that a message lists."""


@dataclass(frozen=True, slots=True)
class Ordered:
    """A scene to render.

    Attributes
    ----------
    quality : Quality or None
        Replaces the scene's own sampling.
    server : str or None
        The service that renders it; None for this process.
    timeout : float
        Seconds to wait for the service.
    """

    folder: Folder
    file: str
    quality: Quality | None
    server: str | None
    timeout: float


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """A linear picture (H, W, 3), its layer `shape` and, if samples are random, `error` and `samples`."""

    image: NDArray[np.float32]
    layers: Mapping[str, NDArray[Any]]
    cpu_seconds: float

    def content(self) -> bytes:
        """The picture as an NPY file."""
        file = io.BytesIO()
        np.save(file, self.image)
        return file.getvalue()


def rendered(order: Ordered) -> Rendered:
    """Render a scene.

    Raises
    ------
    GradingError
        The scene is invalid or cannot be rendered; the class depends on the folder it is in.
    service.client.ClientError
        The service does not answer, or did not render the scene.
    """
    begun = time.monotonic()
    text, assets = order.folder.read(order.file), order.folder.assets(order.file)
    try:
        scene = load_scene(text, assets=assets)
        layers = _layers(order.quality, scene.document)
        if order.server is not None:
            return _by_service(order, text, layers, begun + SERVICE_SHARE * order.timeout)
        result = render(compile_scene(scene, order.quality, layers=layers))
    except SceneError as error:
        raise order.folder.fault(f"{order.file} is not a usable scene. {_listed(error)}") from error
    except RenderError as error:
        raise order.folder.fault(f"{order.file} could not be rendered: {error}") from error
    return Rendered(result.image, result.layers, result.report["cpu_seconds"])


def _layers(quality: Quality | None, scene: Scene) -> tuple[str, ...]:
    sampling = getattr(quality, "antialiasing", None) or scene.sampling.antialiasing
    fixed = quality is None or isinstance(quality, FixedQuality)
    noisy = not fixed or (sampling.pattern in RANDOM and sampling.samples > 1)
    return ("shape", "error", "samples") if noisy else ("shape",)


def _by_service(order: Ordered, text: bytes, layers: tuple[str, ...], until: float) -> Rendered:
    # The client is imported only if a service renders.
    from service.client import Client, JobFailedError, RequestInvalidError  # noqa: PLC0415

    quality = None if order.quality is None else order.quality.model_dump(mode="json", exclude_none=True)
    with Client(order.server, retry_seconds=order.timeout) as client:
        try:
            assets = order.folder.assets(order.file)
            job = client.submit(text, quality=quality, layers=layers, assets=assets)
            _wait(client, job.id, until)
        except (RequestInvalidError, JobFailedError) as error:
            raise order.folder.fault(f"{order.file} was not rendered by the service. {error}") from error
        shown = {name: client.layer(job.id, name) for name in layers}
        return Rendered(client.pixels(job.id), shown, client.get(job.id).cost.cpu_seconds)


def _wait(client: Client, job_id: str, until: float) -> None:
    from service.client import TimedOutError  # noqa: PLC0415

    try:
        client.wait(job_id, timeout=max(0.0, until - time.monotonic()))
    except TimedOutError:
        # The result is no longer needed.
        client.cancel(job_id)
        raise


def _listed(error: SceneError) -> str:
    listed = [f"{problem.pointer or 'document'}: {problem.detail}" for problem in error.errors[:SHOWN]]
    more = len(error.errors) + error.more - len(listed)
    return " ".join(listed) + (f" (and {more} more)" if more else "")
