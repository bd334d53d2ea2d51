"""Displaced surfaces: fine meshes whose vertices are moved along the normal by a height map.

Cracks cannot open: vertices at one place share one normal and one height, the means over the faces that
meet there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import schemas.shapes as language
from renderer.arrays import Floats, Integers, columns, lengths, unit
from renderer.assets import AssetSource
from renderer.cameras import Pinhole
from renderer.shapes import ellipsoids, rectangles
from renderer.shapes.meshes import CORNERS, Surface, joined, placed, smooth_normals, surface_of, triangles_of
from renderer.shapes.triangles import Triangles
from renderer.textures.heights import Heights

PIXELS = 2.0
"""Length of an edge of the fine mesh as seen by the camera, pixels, unless the limit says otherwise."""

MAX_TRIANGLES = 400_000
"""Triangles of one displaced shape, at most."""


@dataclass(frozen=True, slots=True)
class Displaced:
    """A shape and the heights that move it.

    Attributes
    ----------
    number : int
        Of the shape in the scene.
    shape : schemas.shapes.Shape
    heights : Heights
    """

    number: int
    shape: language.Shape
    heights: Heights


@dataclass(frozen=True, slots=True)
class Patch:
    """A fine mesh before it is moved.

    Attributes
    ----------
    positions, normals : (3, V) float64
    coordinates : (2, V) float64
        Texture coordinates; vertices at one place may differ in them.
    triangles : (3, T) int64
    """

    positions: Floats
    normals: Floats
    coordinates: Floats
    triangles: Integers


def build(parts: Sequence[Displaced], camera: Pinhole, assets: AssetSource) -> Triangles:
    """The family of all displaced shapes, fine enough for the camera."""
    return joined([_moved(part, _patch(part.shape, camera, assets)) for part in parts])


def _moved(part: Displaced, patch: Patch) -> Triangles:
    places, owner = np.unique(patch.positions, axis=1, return_inverse=True)
    owner = owner.reshape(-1)
    share = np.bincount(owner)
    heights = np.bincount(owner, part.heights.at(patch.coordinates)) / share
    normals = unit(np.stack([np.bincount(owner, row) for row in patch.normals]))
    moved = (places + normals * heights)[:, owner]
    surface = Surface(moved, patch.triangles, patch.coordinates)
    return triangles_of(part.number, moved, surface, smooth=True)


def _patch(shape: language.Shape, camera: Pinhole, assets: AssetSource) -> Patch:
    if isinstance(shape, language.Ellipsoid | language.Sphere):
        return _ellipsoid(shape, camera, assets)
    surface, normals = _coarse(shape, assets)
    return _subdivided(surface, normals, camera)


def _coarse(shape: language.Shape, assets: AssetSource) -> tuple[Surface, Floats]:
    """A flat shape or a mesh as few triangles, with a normal at each vertex."""
    if isinstance(shape, language.Mesh | language.MeshFile):
        surface = surface_of(shape, assets)
        vertices = placed(surface.vertices, shape)
        if surface.texture is None:
            rows = surface.triangles
            texture = np.tile(CORNERS.T, rows.shape[1])
            vertices = vertices[:, rows.T.reshape(-1)]
            surface = Surface(vertices, np.arange(rows.size).reshape(-1, 3).T, texture)
        return Surface(vertices, surface.triangles, surface.texture), smooth_normals(
            vertices, surface.triangles
        )
    if isinstance(shape, language.Triangle):
        surface = Surface(
            columns(shape.vertices), np.array([[0], [1], [2]]), np.array(shape.uvs or CORNERS).T
        )
        given = smooth_normals(surface.vertices, surface.triangles)
        return surface, given if shape.normals is None else unit(columns(shape.normals))
    corner, first, second = rectangles.edges(shape)
    vertices = np.hstack((corner, corner + first, corner + second, corner + first + second))
    surface = Surface(vertices, np.array([[0, 1], [1, 3], [2, 2]]), np.array([[0.0, 1, 0, 1], [0, 0, 1, 1]]))
    return surface, smooth_normals(vertices, surface.triangles)


def _subdivided(surface: Surface, normals: Floats, camera: Pinhole) -> Patch:
    """Every triangle cut into n * n, the same n for all, so that neighbours keep meeting at vertices.

    A vertex on an edge is the sum of two products, in whichever triangle: the same bits from both sides.
    """
    assert surface.texture is not None
    count = _cuts(surface, camera)
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
    inside = i + j <= count
    second, third = i[inside] / count, j[inside] / count
    first = (count - i[inside] - j[inside]) / count

    def mean(values: Floats) -> Floats:
        a, b, c = (values[:, row, None] for row in surface.triangles)
        return (a * first + b * second + c * third).reshape(values.shape[0], -1)

    numbers = np.full(inside.shape, -1)
    numbers[inside] = np.arange(first.size)
    each = _cells(numbers)
    offsets = np.arange(surface.triangles.shape[1]) * first.size
    triangles = (each[:, None, :] + offsets[None, :, None]).reshape(3, -1)
    return Patch(mean(surface.vertices), mean(normals), mean(surface.texture), triangles)


def _cells(numbers: Integers) -> Integers:
    """Triangles (3, n * n) of a triangular grid of vertex numbers, -1 beyond its long side."""
    here, right, up, across = numbers[:-1, :-1], numbers[1:, :-1], numbers[:-1, 1:], numbers[1:, 1:]
    lower = np.stack((here, right, up)).reshape(3, -1)
    upper = np.stack((right, across, up)).reshape(3, -1)
    return np.hstack((lower[:, lower.min(axis=0) >= 0], upper[:, upper.min(axis=0) >= 0]))


def _cuts(surface: Surface, camera: Pinhole) -> int:
    corners = [surface.vertices[:, row] for row in surface.triangles]
    longest = max(float(_pixels(corners[i], corners[(i + 1) % 3], camera).max(initial=1.0)) for i in range(3))
    most = int(np.sqrt(MAX_TRIANGLES / surface.triangles.shape[1]))
    return max(1, min(int(np.ceil(longest / PIXELS)), most))


def _pixels(start: Floats, end: Floats, camera: Pinhole) -> Floats:
    """Lengths of segments as the camera sees them from the nearer end, pixels."""
    nearest = np.minimum(lengths(start - camera.position), lengths(end - camera.position))
    length = lengths(end - start)
    away = np.maximum(nearest, length / 64)
    return length / np.where(away > 0, away, 1.0) / (2 * camera.half_height) * camera.height


def _ellipsoid(shape: language.Ellipsoid | language.Sphere, camera: Pinhole, assets: AssetSource) -> Patch:
    """A grid of longitudes and latitudes. Its first and last column, and each pole, are one place."""
    family = ellipsoids.build([0], [shape], assets)
    axes, center = family.axes[:, :, 0], family.centers
    radius = float(np.max([lengths(axis[:, None]) for axis in axes]))
    side = np.array([[radius], [0.0], [0.0]])
    girth = np.pi * float(_pixels(center, center + side, camera).item())
    rows = max(8, min(int(np.ceil(girth / PIXELS)), int(np.sqrt(MAX_TRIANGLES / 4))))
    turns = 2 * rows
    v, u = (
        part.reshape(-1)
        for part in np.meshgrid(np.arange(rows + 1) / rows, np.arange(turns + 1) / turns, indexing="ij")
    )
    longitude = 2 * np.pi * np.where(u == 1, 0.0, u)
    pole = (v == 0) | (v == 1)
    ring = np.where(pole, 0.0, np.sin(np.pi * v))
    local = np.stack((ring * np.cos(longitude), ring * np.sin(longitude), -np.cos(np.pi * v)))
    inverse = family.inverse[:, :, 0]
    positions = center + sum(local[i] * axes[i][:, None] for i in range(3))
    normals = unit(np.asarray(sum(local[i] * inverse[i][:, None] for i in range(3))))
    numbers = np.arange(u.size).reshape(rows + 1, turns + 1)
    here, right, up, across = numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, :-1], numbers[1:, 1:]
    triangles = np.hstack(
        (np.stack((here, right, across)).reshape(3, -1), np.stack((here, across, up)).reshape(3, -1))
    )
    return Patch(np.asarray(positions), normals, np.stack((u, v)), triangles)
