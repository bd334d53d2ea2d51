"""The rays of a test, traced by both the reference and the submission."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats
from schemas.cameras import Camera
from schemas.grading.manifests import BallRays, CameraRays, Rays, RaysFile
from service.grading.archives import read_arrays
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder


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
