"""The rays of a test, traced by reference and submission, and arrays from untrusted .npz files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats
from schemas.cameras import Camera
from schemas.grading.manifests import BallRays, CameraRays, Rays, RaysFile
from service.grading.errors import BrokenTestError
from service.grading.folders import MOST_BYTES, Folder


@dataclass(frozen=True, slots=True, eq=False)
class RayList:
    """Rays.

    Attributes
    ----------
    origins, directions : (N, 3) float64
        Finite; no direction is zero.
    """

    origins: Floats
    directions: Floats


def rays_of(source: Rays, camera: Camera, folder: Folder) -> RayList:
    """The rays of a test.

    Raises
    ------
    BrokenTestError
        The file of rays is unusable.
    """
    match source:
        case RaysFile():
            return _of_file(source.file, folder)
        case CameraRays():
            return _of_camera(source, camera)
        case BallRays():
            return _of_ball(source)


def _of_file(name: str, folder: Folder) -> RayList:
    arrays = read_arrays(folder, name, ("origins", "directions"))
    origins, directions = arrays["origins"], arrays["directions"]
    for key, values in arrays.items():
        if values.ndim != 2 or values.shape[1] != 3 or not values.size or not np.isfinite(values).all():
            raise BrokenTestError(f"{name}: '{key}' must be finite and have the shape (N, 3).")
    if len(origins) != len(directions) or not directions.any(axis=1).all():
        raise BrokenTestError(f"{name}: each ray needs an origin, and a direction that is not zero.")
    return RayList(origins, directions)


def _of_camera(source: CameraRays, camera: Camera) -> RayList:
    """Rays through the centres of a grid over the picture; directions have length 1."""
    eye = build_pinhole(camera)
    columns = (np.arange(source.width) + 0.5) * (camera.width / source.width)
    rows = (np.arange(source.height) + 0.5) * (camera.height / source.height)
    y, x = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
    directions = eye.directions(x, y).T
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return RayList(np.repeat(eye.position.T, x.size, axis=0), directions)


def _of_ball(source: BallRays) -> RayList:
    """Rays from uniform points of a sphere to uniform points of a ball; directions have length 1."""
    random = np.random.default_rng(source.seed)
    around = _unit(random.standard_normal((source.count, 3)))
    # Volume grows with the cube of the radius.
    inside = _unit(random.standard_normal((source.count, 3))) * np.cbrt(random.random((source.count, 1)))
    center = np.asarray(source.center)
    origins = center + source.distance * around
    return RayList(origins, _unit(source.radius * inside - source.distance * around))


def _unit(vectors: Floats) -> Floats:
    lengths: Floats = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / lengths


SHAPE = "shape"
"""The array of shape indices, in which a miss is -1."""


def read_arrays(folder: Folder, name: str, wanted: Sequence[str]) -> dict[str, Floats]:
    """Read the arrays of these names as float64, without unpickling anything.

    Raises
    ------
    GradingError
        The file cannot be read, is not an .npz file, lacks an array, or holds other than real numbers.
    """
    content = folder.read(name)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            size = sum(member.file_size for member in packed.infolist())
        # A small archive may unpack to any size.
        if size > MOST_BYTES:
            raise folder.fault(f"{name} unpacks to {size} bytes; at most {MOST_BYTES} are read.")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            found = {key: archive[key] for key in wanted if key in archive}
    except (ValueError, AttributeError, EOFError, TypeError, OSError, zipfile.BadZipFile) as error:
        raise folder.fault(f"{name} is not an .npz file of arrays. Write it with numpy.savez.") from error
    missing = [key for key in wanted if key not in found]
    if missing:
        raise folder.fault(f"{name} has no array {', '.join(map(repr, missing))}. Save them by these names.")
    for key, values in found.items():
        if values.dtype.kind not in "fiub":
            raise folder.fault(f"{name}: '{key}' holds {values.dtype}. It must hold real numbers.")
    return {key: _floats(key, values) for key, values in found.items()}


def _floats(key: str, values: NDArray[Any]) -> Floats:
    floats = np.asarray(values, dtype=np.float64)
    if key == SHAPE and values.dtype.kind == "u":
        # An unsigned type stores -1 as its largest number.
        floats = np.where(values == np.iinfo(values.dtype).max, -1.0, floats)
    return floats
