"""``penumbra compare``: whether two pictures match, and if not, why and where."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError, ExitCode, InputError
from service.cli.options import DEFAULT_SERVER, JsonOption, ServerOption, connect
from service.cli.targets import check_target, save

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from accuracy.comparison import Comparison, Picture
    from accuracy.comparison.decoding import Size

JOB = "job:"
NUMBERS = ("rmse", "psnr", "ssim", "relmse", "max_abs", "frac_over", "flip")

Encoding = Literal["srgb", "linear"]


def compare(  # noqa: PLR0913 - one argument for each option
    *,
    image: Annotated[
        str, typer.Argument(help="The picture in question: .png, .npy, .exr, or job:ID.", show_default=False)
    ],
    reference: Annotated[
        str, typer.Argument(help="The correct picture, in the same forms.", show_default=False)
    ],
    encoding: Annotated[
        Encoding | None,
        typer.Option(help="How IMAGE encodes light; by default srgb for .png, otherwise linear."),
    ] = None,
    reference_encoding: Annotated[Encoding | None, typer.Option(help="The same for REFERENCE.")] = None,
    scene: Annotated[
        str | None,
        typer.Option(metavar="SCENE", help="The scene of the reference: regions are named by its shapes."),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(min=0.0, max=1.0, help="Linear difference of a block's mean that is always tolerated."),
    ] = 0.01,
    max_bias: Annotated[
        float,
        typer.Option(
            min=0.0, max=1.0, help="Share of blocks that may differ by more than noise and tolerance."
        ),
    ] = 0.02,
    limit: Annotated[
        float,
        typer.Option(min=0.0, max=1.0, help="Linear difference above which `frac_over` counts a pixel."),
    ] = 0.05,
    flip: Annotated[
        bool, typer.Option("--flip", help="Also compute FLIP, which is slow and needs the extra `flip`.")
    ] = False,
    fail_under: Annotated[
        float | None,
        typer.Option(
            min=0.0, max=1.0, help="Exit with 1 if the score is lower; a match scores 1, a mismatch 0."
        ),
    ] = None,
    heat_map: Annotated[Path | None, typer.Option(help="Save a heat map of the differences, .png.")] = None,
    side_by_side: Annotated[
        Path | None, typer.Option(help="Save picture, reference and heat map beside each other, .png.")
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    as_json: JsonOption = False,
) -> None:
    """Compare a picture with its reference, and find likely mistakes.

    Shows metrics, and a verdict that allows for noise.
    """
    begun = time.perf_counter(), time.process_time()
    for target in filter(None, (heat_map, side_by_side)):
        check_target(target, (".png",))
    if JOB in (image, reference):
        raise CommandError(f"{JOB} has no id. Write it like {JOB}f9a1c3.")
    from accuracy.comparison import Policy
    from accuracy.comparison import compare as compared
    from renderer.errors import ImageFileError

    try:
        wanted = read(reference, reference_encoding, server)
        picture = read(image, encoding, server, wanted.size)
        shapes, names = (None, []) if scene is None else _shown(scene, wanted)
        policy = Policy(tolerance=tolerance, most_bias=max_bias, limit=limit)
        found = compared(picture, wanted, policy=policy, shapes=shapes, names=names, with_flip=flip)
    except ImageFileError as error:
        raise InputError(str(error)) from error
    _save(found, heat_map, side_by_side)
    document = found.document()
    seconds = {"seconds": time.perf_counter() - begun[0], "cpu_seconds": time.process_time() - begun[1]}
    output.report(document | {"timings": seconds}, lines(document), as_json=as_json)
    if fail_under is not None and document["score"] < fail_under:
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


def read(source: str, encoding: Encoding | None, server: str, size: Size | None = None) -> Picture:
    """The picture of a file, or of a job of the service; of another size it is refused before it is decoded.

    Raises
    ------
    accuracy.comparison.NotComparableError
        It cannot be used.
    """
    from accuracy.comparison import picture_of, read_picture

    if not source.startswith(JOB):
        return read_picture(source, encoding, size)
    from service.client.comparing import parts_of

    with connect(server) as client:
        parts = parts_of(client, source.removeprefix(JOB))
    return picture_of(parts.content, source, encoding, parts.layers, size)


def _shown(name: str, reference: Picture) -> tuple[NDArray[Any], list[str]]:
    from accuracy.comparison.shown import names_of, shapes_shown

    scene = scene_files.load(name).scene
    width, height = scene.document.camera.picture_size
    if (width, height) != (reference.width, reference.height):
        raise InputError(
            f"{name} has {width} x {height} pixels, the reference has {reference.width} x "
            f"{reference.height}. Give the scene that the reference was rendered from."
        )
    return shapes_shown(scene), names_of(scene.document)


def _save(found: Comparison, heat_map: Path | None, side_by_side: Path | None) -> None:
    from accuracy.comparison import heat

    for target, draw in ((heat_map, heat.heat_map), (side_by_side, heat.side_by_side)):
        if target is not None:
            save(target, heat.encoded(draw, found.image, found.reference))


def lines(document: dict[str, Any]) -> Iterator[str]:
    """A comparison as lines: the verdict, why and where, the numbers, and how each file was read."""
    color = "red" if document["verdict"] == "mismatch" else "green"
    yield f"{output.emphasis(document['verdict'], color)}: {document['reason']}"
    yield from _certainty(document)
    for cause in document["diagnosis"]:
        before, after = cause["rmse_before"], cause["rmse_after"]
        undone = f"undone {after:.4f}" if after < before else "cannot be undone"
        yield f"cause: {cause['cause']} (RMSE {before:.4f}, {undone})"
        yield f"  {cause['hint']}"
    for region in document["worst_regions"] if document["verdict"] == "mismatch" else []:
        yield f"where: {_region(region)}"
    metrics = {name: document["metrics"][name] for name in NUMBERS}
    yield "  ".join(f"{name} {value:.4g}" for name, value in metrics.items() if value is not None)
    for role, picture in document["inputs"].items():
        yield f"{role}: {_input(picture)}"


def _certainty(document: dict[str, Any]) -> Iterator[str]:
    margin, factor = document["margin"], document["samples_factor"]
    if margin is not None:
        yield f"margin: {margin:+.0%} of the limit"
    if document["verdict"] == "noisy_match" and factor is not None:
        yield f"With {factor:.2g} times the samples in both pictures this difference would count as real."


def _region(region: dict[str, Any]) -> str:
    brightness = "too bright" if region["brightness"] > 0 else "too dark"
    name = f", mostly {output.harmless(region['name'])}" if region["name"] else ""
    return (
        f"columns {region['x0']} to {region['x1'] - 1}, rows {region['y0']} to {region['y1'] - 1}: "
        f"{brightness} by {abs(region['brightness']):.3f}, {100 * region['share']:.0f} % of the squared "
        f"difference{name}"
    )


def _input(picture: dict[str, Any]) -> str:
    stated = "stated" if picture["encoding_stated"] else "not stated, usual for such files"
    notes = "".join(f" {note}" for note in picture["notes"])
    return (
        f"{output.harmless(picture['name'])}, {picture['width']} x {picture['height']}, "
        f"{picture['bits']} bits, {picture['encoding']} ({stated}), "
        f"{picture['clipped_pixels']} pixels clipped to 0..1.{notes}"
    )
