"""Converged pictures by Mitsuba 3, shaded with exactly the radiance formula of the scene language.

Run `python -m benchmarks.mitsuba_pictures` to make the reference pictures again. It needs the group `bench`
and LLVM 17 or newer; on Debian: `apt-get install libllvm19`, and
`DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1`.

The peer shares nothing with the renderer but the scene file: intersections, light points and samples are
Mitsuba's.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import math
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image
from rich.console import Console

from accuracy.statistics import clipped, rms_difference
from benchmarks.mitsuba_scene import PeerScene, convert
from benchmarks.mitsuba_shading import radiance
from benchmarks.report import SCENES, parser
from schemas.reading import read_scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from schemas.cameras import Camera

FOLDER = SCENES.parent / "tests" / "pictures" / "references"
FOLDERS = {"mesh": "gallery", "normal_texturing": "gallery"}
NAMES = ("soft", "chess", "mesh", "normal_texturing", "lamp", "shell", "textured_room", "lens_room")
PATHS = {name: SCENES / FOLDERS.get(name, "study") / f"{name}.json" for name in NAMES}
"""The scene file that each reference shows."""
_LANES = 2**25


def reference(name: str) -> tuple[NDArray[np.float64], float]:
    """A reference, linear, (H, W, 3), and its own RMSE x 255: in the file red is above green above blue."""
    with Image.open(FOLDER / f"{name}.png") as file:
        levels = np.asarray(file, dtype=np.float64)
    provenance = json.loads((FOLDER / f"{name}.json").read_text())
    return np.stack(np.split(levels, 3), axis=2) / 65535, float(provenance["own_error_255"])


def rmse_255(image: ArrayLike, reference: ArrayLike) -> float:
    """Root mean square difference of linear values clipped to 0..1, in units of 1/255."""
    return 255 * rms_difference(image, reference)


def shot(peer: PeerScene, camera: Camera, samples: int, seed: int) -> NDArray[np.float64]:
    """Mean linear radiance of each pixel (H, W, 3), not clipped, one point of each light for each sample."""
    rows = max(1, _LANES // (camera.width * samples))
    starts = range(0, camera.height, rows)
    bands = [
        _band(peer, camera, (start, min(start + rows, camera.height)), samples, seed) for start in starts
    ]
    return np.concatenate(bands)


def _band(
    peer: PeerScene, camera: Camera, rows: tuple[int, int], samples: int, seed: int
) -> NDArray[np.float64]:
    pixels = (rows[1] - rows[0]) * camera.width
    points = mi.load_dict({"type": "multijitter", "sample_count": samples})
    if points.sample_count() != samples:
        raise ValueError(f"the sampler takes {points.sample_count()} samples in place of {samples}")
    points.set_samples_per_wavefront(samples)
    points.seed(seed * camera.height + rows[0], pixels * samples)
    pixel = dr.arange(mi.UInt32, pixels * samples) // samples
    column, row = pixel % camera.width, pixel // camera.width + dr.opaque(mi.UInt32, rows[0])
    value = radiance(peer, _camera_ray(camera, column, row, points), points)
    sums = [dr.zeros(mi.Float64, pixels) for _ in range(3)]
    for total, component in zip(sums, value, strict=True):
        dr.scatter_reduce(dr.ReduceOp.Add, total, mi.Float64(component), pixel)
    dr.eval(sums)
    return np.stack([np.array(total) for total in sums], axis=1).reshape(-1, camera.width, 3) / samples


def _camera_ray(camera: Camera, column: Any, row: Any, points: Any) -> Any:
    position, look_at, up = (np.array(v) for v in (camera.position, camera.look_at, camera.up))
    forward = (look_at - position) / np.linalg.norm(look_at - position)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    above = np.cross(right, forward)
    half = math.tan(math.radians(camera.vertical_fov) / 2)
    inside = points.next_2d()
    across = half * camera.width / camera.height * (2 * (column + inside.x) / camera.width - 1)
    upward = half * (1 - 2 * (row + inside.y) / camera.height)
    f, r, u = (mi.Vector3f(*axis.tolist()) for axis in (forward, right, above))
    origin, direction = mi.Point3f(*camera.position), f + r * across + u * upward
    if camera.lens_radius:
        away = float(np.linalg.norm(look_at - position))
        focus = away if camera.focus_distance is None else camera.focus_distance
        place = camera.lens_radius * mi.warp.square_to_uniform_disk_concentric(points.next_2d())
        offset = r * place.x + u * place.y
        # All rays of a place on the picture intersect where the pinhole's crosses the plane in focus.
        origin, direction = origin + offset, direction - offset / focus
    return mi.Ray3f(origin, dr.normalize(direction))


def make_reference(name: str, samples: int, pictures: int) -> float:
    """Average independent pictures, keep the mean, and give its own RMSE x 255, from two halves."""
    path = PATHS[name]
    scene, _ = read_scene(path.read_bytes())
    peer = convert(scene, path.parent)
    halves = [
        np.mean([shot(peer, scene.camera, samples, seed) for seed in range(first, pictures, 2)], axis=0)
        for first in (0, 1)
    ]
    content = scene.model_dump(mode="json", exclude={"name", "sampling"}, exclude_unset=True)
    error = rmse_255(*halves) / 2
    provenance = {
        "renderer": f"Mitsuba {mi.__version__} {mi.variant()}",
        "command": f"python -m benchmarks.mitsuba_pictures --samples {samples} --pictures {pictures} {name}",
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "samples_per_pixel": samples * pictures,
        "own_error_255": round(error, 4),
        "scene_sha256": hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest(),
    }
    (FOLDER / f"{name}.json").write_text(json.dumps(provenance, indent=2) + "\n")
    # A 16-bit greyscale PNG, red above green above blue, is a fifth of an array file.
    levels = np.floor(clipped((halves[0] + halves[1]) / 2) * 65535 + 0.5).astype(np.uint16)
    stacked = np.concatenate(list(np.moveaxis(levels, 2, 0)))
    Image.fromarray(stacked).save(FOLDER / f"{name}.png", optimize=True)
    return error


def main() -> None:
    """Make the references named on the command line, or all of them."""
    options = parser("mitsuba_pictures", __doc__)
    options.add_argument("names", nargs="*", default=[*NAMES], metavar="NAME")
    options.add_argument("--samples", type=int, default=1024, help="samples a pixel of each picture")
    options.add_argument("--pictures", type=int, default=8, help="independent pictures, an even number")
    chosen = options.parse_args()
    for name in chosen.names:
        error = make_reference(name, chosen.samples, chosen.pictures)
        Console().print(f"{name}: own error {error:.4f}/255")


if __name__ == "__main__":
    main()
