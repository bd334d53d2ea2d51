"""``penumbra render`` and ``trace``: renders a scene file, or casts rays into it, on this machine."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import InputError
from service.cli.options import (
    BitsOption,
    JsonOption,
    LayersOption,
    SceneArgument,
    SeedOption,
    WorkersOption,
    image_option,
)
from service.cli.progress import progress_bar, remaining
from service.cli.quality_options import QualityOptions, flattened_options
from service.cli.size_options import SizeOptions
from service.cli.targets import ImageTarget, check_target, parsed_layers, save_layer, write_whole

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from renderer import Hits, LoadedScene, RenderPlan, RenderResult, TileEvent


@flattened_options
def render(  # noqa: PLR0913 - one argument for each option
    *,
    scene: SceneArgument,
    out: Annotated[ImageTarget, image_option("Where the picture goes")],
    quality: QualityOptions,
    size: SizeOptions,
    layers: LayersOption = None,
    seed: SeedOption = None,
    workers: WorkersOption = None,
    tile: Annotated[int | None, typer.Option(min=1, help="Side of a tile, pixels.")] = None,
    bits: BitsOption = "8",
    as_json: JsonOption = False,
) -> None:
    """Render a scene on this machine, without a server.

    Workers and tiles do not change the picture.
    """
    names = parsed_layers(layers)
    out.check(names, as_json=as_json)
    out.check_bits(int(bits))
    if out.suffix == ".exr":
        from renderer.images.files import require_exr

        require_exr()
    file = scene_files.load(scene, seed=seed, size=size)
    requested = quality.requested(file.scene.document.model_dump())
    result = _run(file.plan(requested, names), workers, tile)
    _save(file.scene, result, out, int(bits))
    if as_json:
        output.document(result.report)
    else:
        output.say(f"{out}: {result.report['width']} x {result.report['height']} pixels, {_cost(result)}")


def _run(plan: RenderPlan, workers: int | None, tile: int | None) -> RenderResult:
    from renderer import render as render_plan

    with progress_bar("rendering") as bar:

        def show(event: TileEvent) -> None:
            bar.show(event.share, f"tile {event.done}{remaining(event.remaining_seconds)}")

        # Without a bar no preview is needed.
        on_tile = show if bar.visible else None
        result = render_plan(plan, on_tile=on_tile, workers=workers or "auto", tile_size=tile)
        bar.show(1.0)
        return result


def _save(scene: LoadedScene, result: RenderResult, out: ImageTarget, bits: int) -> None:
    from renderer.images.files import encode, encode_layer

    out.write(encode(out.suffix, result.image, scene.document.display, result.layers, bits=bits))
    for name, values in result.layers.items():
        save_layer(out.path, name, encode_layer(values))


def _cost(result: RenderResult) -> str:
    report = result.report
    rays = sum(report["rays"].values())
    error = f", error {output.reached_error(**report['error'])}" if report["error"] else ""
    return f"{report['seconds']:.2f} s, {report['cpu_seconds']:.2f} CPU s, {rays:,} rays{error}"


def trace(
    scene: SceneArgument,
    rays: Annotated[
        Path,
        typer.Argument(
            metavar="RAYS.npz", help="Arrays `origins` and `directions`, (N, 3).", show_default=False
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The hits to write, .npz.")],
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Cast rays into a scene and save what each of them hits first."""
    check_target(out, (".npz",))
    from renderer import trace as trace_rays

    origins, directions = read_rays(rays)
    plan = scene_files.load(scene, seed=seed).plan()
    try:
        hits = trace_rays(plan, origins, directions)
    except ValueError as error:
        raise InputError(f"{rays}: {error}") from error
    write_whole(out, _encoded_hits(hits))
    hit = int((hits.shape >= 0).sum())
    if as_json:
        output.document({"rays": len(origins), "hits": hit, "misses": len(origins) - hit, "out": str(out)})
    else:
        output.say(f"{out}: {hit:,} of {len(origins):,} rays hit something")


def read_rays(path: Path) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Origins and directions of a file.

    Returns
    -------
    origins, directions
        Shape (rays, 3), float64, finite; no direction is zero.

    Raises
    ------
    InputError
        The file is not such a file; the message names the array and the row.
    """
    import numpy as np

    try:
        # NumPy leaves a file open that it was given by name and could not read.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in ("origins", "directions") if name in archive}
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (ValueError, AttributeError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} is not an .npz file of arrays. Write it with numpy.savez.") from error
    origins, directions = (_checked(path, arrays, name) for name in ("origins", "directions"))
    if len(origins) != len(directions):
        raise InputError(f"{path} has {len(origins)} origins but {len(directions)} directions.")
    zero = np.flatnonzero(~directions.any(axis=1))
    if zero.size:
        raise InputError(f"{path}: row {zero[0]} of 'directions' is zero. A ray needs a direction.")
    return origins, directions


def _checked(path: Path, arrays: dict[str, Any], name: str) -> npt.NDArray[np.float64]:
    import numpy as np

    if name not in arrays:
        raise InputError(f"{path} has no array '{name}'. It needs 'origins' and 'directions', both (N, 3).")
    array = arrays[name]
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{path}: '{name}' has shape {array.shape}. It must be (N, 3).")
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: '{name}' holds {array.dtype}. It must hold real numbers.")
    wrong = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if wrong.size:
        raise InputError(f"{path}: row {wrong[0]} of '{name}' is not finite ({wrong.size} such rows).")
    return np.asarray(array, dtype=np.float64)


def _encoded_hits(hits: Hits) -> bytes:
    from dataclasses import asdict

    import numpy as np

    file = io.BytesIO()
    np.savez(file, **asdict(hits))
    return file.getvalue()
