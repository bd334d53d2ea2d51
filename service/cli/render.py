"""``penumbra render``: a scene file becomes a picture in this machine's worker processes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import layers as layer_files
from service.cli import output, qualities, scene_files
from service.cli.errors import CommandError, RenderFailedError
from service.cli.progress import progress_bar, remaining
from service.cli.targets import ImageTarget
from service.cli.workers import WorkersOption

if TYPE_CHECKING:
    from renderer import LoadedScene, RenderPlan, RenderResult, TileEvent

OutOption = Annotated[
    ImageTarget,
    typer.Option(
        "-o",
        "--out",
        parser=ImageTarget.named,
        metavar="FILE",
        help="Where the picture goes: .png, .npy for linear float32, or .exr; - or -.npy is stdout.",
    ),
]
TileOption = Annotated[int | None, typer.Option(min=1, help="Side of a tile, pixels.")]


def render(  # noqa: PLR0913 - one argument for each option
    *,
    scene: scene_files.SceneArgument,
    out: OutOption,
    samples: qualities.SamplesOption = None,
    pattern: qualities.PatternOption = None,
    light_samples: qualities.LightSamplesOption = None,
    light_pattern: qualities.LightPatternOption = None,
    precision: qualities.PrecisionOption = None,
    target_error: qualities.TargetErrorOption = None,
    confidence: qualities.ConfidenceOption = None,
    time_limit: qualities.TimeLimitOption = None,
    layers: layer_files.LayersOption = None,
    seed: scene_files.SeedOption = None,
    workers: WorkersOption = None,
    tile: TileOption = None,
    as_json: output.JsonOption = False,
) -> None:
    """Render a scene here, without a server. The bytes do not depend on workers and tiles."""
    names = layer_files.parsed(layers)
    out.check(with_layers=bool(names), as_json=as_json)
    layer_files.check_targets(out.path, names)
    _check_format(out)
    file = scene_files.load(scene, seed=seed)
    quality = qualities.quality(
        file.scene.document.model_dump(),
        samples=samples,
        pattern=pattern,
        light_samples=light_samples,
        light_pattern=light_pattern,
        precision=precision,
        target_error=target_error,
        confidence=confidence,
        time_limit=time_limit,
    )
    result = _run(file.plan(quality, names), workers, tile)
    _save(file.scene, result, out)
    if as_json:
        output.document(result.report)
    else:
        output.say(f"{out}: {result.report['width']} x {result.report['height']} pixels, {_cost(result)}")


def _run(plan: RenderPlan, workers: int | None, tile: int | None) -> RenderResult:
    from renderer import RenderError
    from renderer import render as render_plan

    processes = workers or len(os.sched_getaffinity(0))
    with progress_bar("rendering") as bar:

        def show(event: TileEvent) -> None:
            bar.show(event.share, f"tile {event.done}{remaining(event.remaining_seconds)}")

        # Without somebody who looks there is no preview to render.
        on_tile = show if bar.visible else None
        try:
            result = render_plan(plan, on_tile=on_tile, workers=processes, tile_size=tile)
        except RenderError as error:
            raise RenderFailedError(str(error)) from error
        bar.show(1.0)
        return result


def _check_format(out: ImageTarget) -> None:
    if out.suffix == ".exr":
        from renderer.errors import MissingExtraError
        from renderer.images.files import require_exr

        try:
            require_exr()
        except MissingExtraError as error:
            raise CommandError(str(error)) from error


def _save(scene: LoadedScene, result: RenderResult, out: ImageTarget) -> None:
    from renderer.images.files import encode, encode_layer

    out.write(encode(out.suffix, result.image, scene.document.display, result.layers))
    for name, values in result.layers.items():
        layer_files.save(out.path, name, encode_layer(values))


def _cost(result: RenderResult) -> str:
    report = result.report
    rays = sum(report["rays"].values())
    error = f", error {output.reached_error(**report['error'])}" if report["error"] else ""
    return f"{report['seconds']:.2f} s, {report['cpu_seconds']:.2f} CPU s, {rays:,} rays{error}"
