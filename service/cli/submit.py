"""``penumbra submit``: hand a scene file and its textures to a service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.connection import (
    DEFAULT_SERVER,
    LONG_PATIENCE,
    SHORT_PATIENCE,
    LabelOption,
    ServerOption,
    TimeoutOption,
    connect,
    parsed_labels,
)
from service.cli.errors import CommandError, RefusedOptionsError, UnusableSceneError
from service.cli.jobs import save_picture
from service.cli.render_options import QualityOptions, spread_quality
from service.cli.targets import (
    ImageTarget,
    LayersOption,
    check_layer_targets,
    parsed_layers,
)
from service.cli.watch import detachable, show_end, stay

if TYPE_CHECKING:
    from schemas.jobs import Job
    from schemas.problems import Problem
    from service.client import Client, RequestInvalidError

WaitOption = Annotated[bool, typer.Option("--wait", help="Stay until the image is complete.")]
OutOption = Annotated[
    ImageTarget | None,
    typer.Option(
        "-o",
        "--out",
        parser=ImageTarget.named,
        metavar="FILE",
        help="Stay, and save the image: .png, .npy (linear float32) or .exr; - or -.npy is stdout.",
    ),
]
# Written down twice so that help need not load the schemas; a test compares the two.
PRIORITIES = (-10, 10)
PriorityOption = Annotated[
    int,
    typer.Option(
        min=PRIORITIES[0],
        max=PRIORITIES[1],
        help="Of your own jobs those of a higher priority go first.",
    ),
]
FreshOption = Annotated[
    bool, typer.Option("--fresh", help="Render it even if the service has the same picture already.")
]

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
"""Places in the request, and the options that they are made of; the first that fits counts."""


@spread_quality
def submit(  # noqa: PLR0913 - one argument for each option
    *,
    scene: scene_files.SceneArgument,
    out: OutOption = None,
    wait: WaitOption = False,
    timeout: TimeoutOption = None,
    quality: QualityOptions,
    layers: LayersOption = None,
    label: LabelOption = None,
    priority: PriorityOption = 0,
    fresh: FreshOption = False,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Send a scene to a service and print the job's id."""
    names = parsed_layers(layers)
    if out is not None:
        out.check(with_layers=bool(names), as_json=as_json)
        check_layer_targets(out.path, names)
    requested = {"layers": names, "labels": parsed_labels(label), "priority": priority, "anew": fresh}
    stays = wait or out is not None
    if timeout is not None and not stays:
        raise CommandError("--timeout says how long to stay. Give --wait or -o too.")
    with connect(server, patience=LONG_PATIENCE if stays else SHORT_PATIENCE) as client:
        job = send(client, scene, quality, requested)
        if not as_json:
            # An image on stdout is alone there.
            (output.say if out is not None and out.on_stdout else output.result)(job.id)
        if stays:
            with detachable(job.id):
                job = stay(client, job.id, timeout=timeout)
            if out is not None:
                save_picture(client, job.id, out, names)
        if as_json:
            output.document(job.model_dump(mode="json"))
        elif stays:
            show_end(job, as_json=False)


def send(
    client: Client,
    name: str,
    quality: QualityOptions,
    requested: Mapping[str, Any],
) -> Job:
    """Submit a scene file; what the service finds wrong is shown with the lines of that file.

    Parameters
    ----------
    quality
        The options that choose it.
    requested
        What else ``Client.submit`` takes.

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
        wanted = quality.requested(scene_files.parsed(text))
        job = client.submit(
            text,
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
    """What a refusal means to whoever gave a scene file and options, of which the request was made."""
    # What lies in the scene has a line; the rest of the request is made of the options.
    wrong = [problem for problem in error.errors if problem.line is None]
    if not error.errors:
        return error
    if len(wrong) == len(error.errors):
        return RefusedOptionsError(" ".join(map(_about_option, wrong)), wrong)
    problems = [problem if problem.line else _of_option(problem) for problem in error.errors]
    return UnusableSceneError(name, text, problems, error.document.more)


def _about_option(problem: Problem) -> str:
    return f"{_option(problem.pointer)}: {problem.detail}"


def _of_option(problem: Problem) -> Problem:
    return problem.model_copy(update={"pointer": _option(problem.pointer)})


def _option(pointer: str) -> str:
    """The option that a place in the request is made of; the place itself where there is none."""
    for place, option in OPTIONS.items():
        if pointer == place or pointer.startswith(place + "/"):
            return option
    return pointer
