"""Displaced surfaces: fine meshes whose vertices are moved along the normal by a height map.

Cracks cannot open: vertices at one place share one normal and one height, the means over the faces that
meet there. What the shape was shaded with stays, and is turned as the relief turns the surface, so that a
smooth mesh stays smooth, a flat one keeps its edges, and flat heights give the picture without them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import schemas.shapes as language
from renderer.arrays import Floats, Integers, columns, dot, lengths, unit
from renderer.assets import AssetSource
from renderer.cameras import Pinhole
from renderer.shapes import ellipsoids, rectangles, triangles
from renderer.shapes.meshes import CORNERS, Surface, joined, placed, smooth_normals, surface_of, triangles_of
from renderer.shapes.triangles import Triangles
from renderer.textures.heights import Heights

PIXELS = 2.0
"""Length of an edge of the fine mesh as seen by the camera, pixels, unless the limit says otherwise."""

MAX_TRIANGLES = 400_000
"""Triangles of all displaced shapes of a scene together, at most; each has the same part of them."""


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
        Normals of any length, along which the positions are moved.
    shading : (3, V) float64
        Unit normals that the shape is shaded with where it lies.
    coordinates : (2, V) float64
        Texture coordinates; vertices at one place may differ in them.
    triangles : (3, T) int64
    """

    positions: Floats
    normals: Floats
    shading: Floats
    coordinates: Floats
    triangles: Integers


def build(parts: Sequence[Displaced], camera: Pinhole, assets: AssetSource) -> Triangles:
    """The family of all displaced shapes, fine enough for the camera."""
    most = MAX_TRIANGLES // len(parts)
    return joined([_moved(part, _patch(part.shape, camera, assets, most)) for part in parts])


def _moved(part: Displaced, patch: Patch) -> Triangles:
    places, owner = np.unique(patch.positions, axis=1, return_inverse=True)
    owner = owner.reshape(-1)
    share = np.bincount(owner)
    heights = np.bincount(owner, part.heights.at(patch.coordinates)) / share
    normals = unit(np.stack([np.bincount(owner, row) for row in patch.normals]))
    moved = (places + normals * heights)[:, owner]
    surface = Surface(moved, patch.triangles, patch.coordinates)
    family = triangles_of(part.number, moved, surface, smooth=True)
    family.vertex_normals = _turned(patch, family.vertex_normals)
    return family


def _turned(patch: Patch, moved: Floats) -> Floats:
    """Unit normals at the corners (3, 3, T): the shape's own plus what the relief adds to the surface's."""
    own = patch.shading - smooth_normals(patch.positions, patch.triangles)
    return np.stack([unit(own[:, row] + corner) for row, corner in zip(patch.triangles, moved, strict=True)])


def _patch(shape: language.Shape, camera: Pinhole, assets: AssetSource, most: int) -> Patch:
    match shape:
        case language.Ellipsoid() | language.Sphere():
            return _ellipsoid(shape, camera, assets, most)
        case language.Mesh() | language.MeshFile():
            surface = _mesh(shape, assets)
        case language.Triangle():
            surface = Surface(
                columns(shape.vertices), np.array([[0], [1], [2]]), np.array(shape.uvs or CORNERS).T
            )
        case _:
            surface = _rectangle(shape)
    return _subdivided(surface, _normals(shape, surface), _cuts(surface, camera, most), smooth=_smooth(shape))


def _normals(shape: language.Shape, surface: Surface) -> Floats:
    """Normals at the vertices: those that a triangle states, else means of the faces'."""
    if isinstance(shape, language.Triangle) and shape.normals is not None:
        return triangles.vertex_normals([shape], _face_normals(surface))[:, :, 0].T
    return smooth_normals(surface.vertices, surface.triangles)


def _face_normals(surface: Surface) -> Floats:
    return triangles.unit_normals(np.stack([surface.vertices[:, row] for row in surface.triangles]))


def _smooth(shape: language.Shape) -> bool:
    if isinstance(shape, language.Triangle):
        return shape.normals is not None
    return getattr(shape, "smooth", False)


def _mesh(shape: language.Mesh | language.MeshFile, assets: AssetSource) -> Surface:
    """A mesh in its place. Without texture coordinates, each triangle gets some of its own."""
    surface = surface_of(shape, assets)
    vertices, rows = placed(surface.vertices, shape), surface.triangles
    if surface.texture is not None:
        return Surface(vertices, rows, surface.texture)
    apart = np.arange(rows.size).reshape(-1, 3).T
    return Surface(vertices[:, rows.T.reshape(-1)], apart, np.tile(CORNERS.T, rows.shape[1]))


def _rectangle(shape: language.Rectangle | language.Parallelogram) -> Surface:
    corner, first, second = rectangles.edges(shape)
    vertices = np.hstack((corner, corner + first, corner + second, corner + first + second))
    return Surface(vertices, np.array([[0, 1], [1, 3], [2, 2]]), np.array([[0.0, 1, 0, 1], [0.0, 0, 1, 1]]))


def _subdivided(surface: Surface, normals: Floats, count: int, *, smooth: bool) -> Patch:
    """Every triangle cut into n * n, the same n for all, so that neighbours keep meeting at vertices.

    A vertex on an edge is the sum of two products, in whichever triangle: the same bits from both sides.
    """
    assert surface.texture is not None
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
    rows = (each[:, None, :] + offsets[None, :, None]).reshape(3, -1)
    along = mean(normals)
    shading = unit(along) if smooth else _face_normals(surface).repeat(first.size, axis=1)
    return Patch(mean(surface.vertices), along, shading, mean(surface.texture), rows)


def _cells(numbers: Integers) -> Integers:
    """Triangles (3, n * n) of a triangular grid of vertex numbers, -1 beyond its long side."""
    here, right, up, across = numbers[:-1, :-1], numbers[1:, :-1], numbers[:-1, 1:], numbers[1:, 1:]
    lower = np.stack((here, right, up)).reshape(3, -1)
    upper = np.stack((right, across, up)).reshape(3, -1)
    return np.hstack((lower[:, lower.min(axis=0) >= 0], upper[:, upper.min(axis=0) >= 0]))


def _cuts(surface: Surface, camera: Pinhole, most: int) -> int:
    corners = [surface.vertices[:, row] for row in surface.triangles]
    longest = max(float(_pixels(corners[i], corners[(i + 1) % 3], camera).max(initial=1.0)) for i in range(3))
    allowed = int(np.sqrt(most / surface.triangles.shape[1]))
    return max(1, min(int(np.ceil(longest / PIXELS)), allowed))


def _pixels(start: Floats, end: Floats, camera: Pinhole) -> Floats:
    """Lengths of segments as the camera sees them from the nearer end, pixels."""
    nearest = np.minimum(lengths(start - camera.position), lengths(end - camera.position))
    length = lengths(end - start)
    away = np.maximum(nearest, length / 64)
    return length / np.where(away > 0, away, 1.0) / (2 * camera.half_height) * camera.height


def _ellipsoid(
    shape: language.Ellipsoid | language.Sphere, camera: Pinhole, assets: AssetSource, most: int
) -> Patch:
    """A grid of longitudes and latitudes. Its first and last column, and each pole, are one place."""
    family = ellipsoids.build([0], [shape], assets)
    axes, inverse = family.axes[:, :, 0], family.inverse[:, :, 0]
    radius = float(np.max([lengths(axis[:, None]) for axis in axes]))
    side = np.array([[radius], [0.0], [0.0]])
    half_round = np.pi * float(_pixels(family.centers, family.centers + side, camera).item())
    rows = max(3, min(int(np.ceil(half_round / PIXELS)), int(np.sqrt(most / 4))))
    coordinates, cells = _graticule(rows)
    local = _on_sphere(coordinates)
    positions = family.centers + np.stack([dot(local, axes[:, i, None]) for i in range(3)])
    normals = unit(np.stack([dot(local, inverse[:, i, None]) for i in range(3)]))
    return Patch(positions, normals, normals, coordinates, cells)


def _graticule(rows: int) -> tuple[Floats, Integers]:
    """Texture coordinates (2, V) and triangles (3, T) of a grid of 2 rows x rows cells.

    A cell is cut in two, but one at a pole is a triangle: of its other half two corners are the pole.
    """
    turns = 2 * rows
    v, u = np.meshgrid(np.arange(rows + 1) / rows, np.arange(turns + 1) / turns, indexing="ij")
    numbers = np.arange(u.size).reshape(u.shape)
    here, right, up, across = numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, :-1], numbers[1:, 1:]
    lower, upper = np.stack((here, right, across))[:, 1:], np.stack((here, across, up))[:, :-1]
    return np.stack((u.ravel(), v.ravel())), np.hstack((lower.reshape(3, -1), upper.reshape(3, -1)))


def _on_sphere(coordinates: Floats) -> Floats:
    """Points (3, V) of the unit sphere; longitude 1 has the bits of longitude 0, and a pole is one point."""
    u, v = coordinates
    longitude = 2 * np.pi * np.where(u == 1, 0.0, u)
    ring = np.where((v == 0) | (v == 1), 0.0, np.sin(np.pi * v))
    return np.stack((ring * np.cos(longitude), ring * np.sin(longitude), -np.cos(np.pi * v)))
