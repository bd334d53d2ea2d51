"""``penumbra submit``: sends a scene file and its textures to a service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError, RefusedOptionsError, UnusableSceneError
from service.cli.jobs import save_picture
from service.cli.options import (
    DEFAULT_SERVER,
    LONG_RETRY,
    PRIORITIES,
    SHORT_RETRY,
    JsonOption,
    LabelOption,
    LayersOption,
    SceneArgument,
    ServerOption,
    TimeoutOption,
    connect,
    image_option,
    parsed_labels,
)
from service.cli.quality_options import QualityOptions, flattened_options
from service.cli.size_options import SizeOptions
from service.cli.targets import ImageTarget, parsed_layers
from service.cli.watch import detachable, show_end, stay

if TYPE_CHECKING:
    from schemas.api.jobs import Job
    from service.client import Client, RequestInvalidError

OPTIONS = {
    "/quality/error": "--target-error",
    "/quality/confidence": "--confidence",
    "/quality/time_limit": "--time-limit",
    "/quality/precision": "--precision",
    "/quality/antialiasing/samples": "--samples",
    "/quality/antialiasing": "--pattern",
    "/quality/light/samples": "--light-samples",
    "/quality/light": "--light-pattern",
    "/quality": "the options of quality",
    "/layers": "--layers",
    "/labels": "--label",
    "/priority": "--priority",
}
"""Pointers into the request, and the options that they come from; the first match counts."""


@flattened_options
def submit(  # noqa: PLR0913 - one argument for each option
    *,
    scene: SceneArgument,
    out: Annotated[ImageTarget | None, image_option("Wait, and save the picture")] = None,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until the picture is finished.")] = False,
    timeout: TimeoutOption = None,
    quality: QualityOptions,
    size: SizeOptions,
    layers: LayersOption = None,
    label: LabelOption = None,
    priority: Annotated[
        int,
        typer.Option(
            min=PRIORITIES[0],
            max=PRIORITIES[1],
            help="Among your own jobs, those with a higher priority run first.",
        ),
    ] = 0,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Render it even if the service has the same picture already.")
    ] = False,
    server: ServerOption = DEFAULT_SERVER,
    as_json: JsonOption = False,
) -> None:
    """Send a scene to a service and print the job's id."""
    names = parsed_layers(layers)
    if out is not None:
        out.check(names, as_json=as_json)
    requested = {"layers": names, "labels": parsed_labels(label), "priority": priority, "anew": fresh}
    stays = wait or out is not None
    if timeout is not None and not stays:
        raise CommandError("--timeout limits waiting. Give --wait or -o too.")
    with connect(server, retry=LONG_RETRY if stays else SHORT_RETRY) as client:
        job = send(client, scene, quality, size, requested)
        if not as_json:
            # Nothing else may be on stdout beside an image.
            (output.say if out is not None and out.on_stdout else output.result)(job.id)
        if stays:
            with detachable(job.id):
                job = stay(client, job.id, timeout=timeout)
            if out is not None:
                save_picture(client, job.id, out, names)
        if as_json:
            output.document(job)
        elif stays:
            show_end(job, as_json=False)


def send(
    client: Client, name: str, quality: QualityOptions, size: SizeOptions, requested: Mapping[str, Any]
) -> Job:
    """Submit a scene file; problems are shown with the lines of that file.

    Parameters
    ----------
    quality, size
        The options that choose them.
    requested
        Further arguments of ``Client.submit``.

    Raises
    ------
    UnusableSceneError
        The file is not a usable scene.
    RefusedOptionsError
        The service refused what the options ask for.
    """
    from renderer.assets import FolderAssets
    from schemas.errors import SceneError
    from service.client import RequestInvalidError

    text = scene_files.read_bytes(name)
    try:
        document = scene_files.parsed(text)
        wanted = quality.requested(document)
        job = client.submit(
            size.applied(document) if size else text,
            quality=None if wanted is None else wanted.model_dump(mode="json", exclude_none=True),
            **requested,
            assets=FolderAssets(scene_files.folder_of(name)),
        )
    except SceneError as error:
        raise UnusableSceneError(name, text, error.errors, error.more) from error
    except RequestInvalidError as error:
        raise _refused(name, text, error) from error
    scene_files.print_warnings(text, job.warnings)
    return job


def _refused(name: str, text: bytes, error: RequestInvalidError) -> Exception:
    """The error of a refusal, about the scene file and the options that the request was made of."""
    from schemas.reading.findings import located

    # Problems of the scene have lines, but for a document that was resized; all others come from the options.
    wrong = [problem for problem in error.errors if problem.line is None]
    inside = [problem for problem in wrong if _option(problem.pointer) == problem.pointer]
    if not error.errors:
        return error
    if len(wrong) == len(error.errors) and not inside:
        message = " ".join(f"{_option(problem.pointer)}: {problem.detail}" for problem in wrong)
        return RefusedOptionsError(message, wrong)
    placed = dict(zip(inside, located(text.decode("utf-8-sig"), inside), strict=True))
    problems = [
        placed.get(problem, problem)
        if problem.line or problem in placed
        else problem.model_copy(update={"pointer": _option(problem.pointer)})
        for problem in error.errors
    ]
    return UnusableSceneError(name, text, problems, error.document.more)


def _option(pointer: str) -> str:
    """The option that sets a place in the request, or the place itself if there is none."""
    for place, option in OPTIONS.items():
        if pointer == place or pointer.startswith(place + "/"):
            return option
    return pointer
