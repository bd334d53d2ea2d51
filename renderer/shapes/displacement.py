"""Displaced surfaces: fine meshes whose vertices are moved along the normal by a height map.

Cracks cannot open: vertices at one place share one normal and one height, the means over the faces that
share it, and so do shapes along a border that they share (`borders`). What the shape was shaded with stays,
and is turned as the relief turns the surface, so that a smooth mesh stays smooth, a flat one keeps its edges,
and flat heights give the picture without them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, assert_never

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, columns, dot, lengths, unit
from renderer.meshes.triangulation import CORNERS
from renderer.shapes import ellipsoids, rectangles, triangles
from renderer.shapes.borders import Lift, join, neighbours, open_edges
from renderer.shapes.meshes import (
    Surface,
    joined,
    mirrored,
    placed,
    smooth_normals,
    surface_of,
    triangles_of,
)
from renderer.shapes.triangles import Triangles

PIXELS = 2.0
"""Length of an edge of the fine mesh as seen by the camera, pixels, unless the limit says otherwise."""

MAX_TRIANGLES = 400_000
"""Triangles of all displaced shapes of a scene together, at most; each has the same part of them."""


class Heights(Protocol):
    """Heights over a surface."""

    def at(self, coordinates: Floats) -> Floats:
        """Heights (N,) at texture coordinates (2, N), scene units."""
        ...


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


@dataclass(frozen=True, slots=True, eq=False)
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
    border : (V,) bool
        Whether the shape ends there.
    """

    positions: Floats
    normals: Floats
    shading: Floats
    coordinates: Floats
    triangles: Integers
    border: Masks


def build(parts: Sequence[Displaced], camera: Pinhole, assets: AssetSource) -> Triangles:
    """The family of all displaced shapes, fine enough for the camera."""
    most = MAX_TRIANGLES // len(parts)
    surfaces = [_surface(part.number, part.shape, assets) for part in parts]
    together = _of_one_relief(parts)
    cuts = _cuts(surfaces, together, camera, most)
    patches = [
        _round(part.shape, camera, assets, most) if surface is None else _flat(part.shape, surface, count)
        for part, surface, count in zip(parts, surfaces, cuts.tolist(), strict=True)
    ]
    lifts = [_lift(part, patch) for part, patch in zip(parts, patches, strict=True)]
    for group in together:
        join([lifts[i] for i in group])
    mapped = [surface is None or surface.mapped for surface in surfaces]
    return joined([_moved(*each) for each in zip(parts, patches, lifts, mapped, strict=True)])


def _of_one_relief(parts: Sequence[Displaced]) -> list[list[int]]:
    """Shapes that are moved by the same heights, several each."""
    groups: dict[int, list[int]] = {}
    for i, part in enumerate(parts):
        groups.setdefault(id(part.heights), []).append(i)
    return [group for group in groups.values() if len(group) > 1]


def _lift(part: Displaced, patch: Patch) -> Lift:
    places, owner = np.unique(patch.positions, axis=1, return_inverse=True)
    owner = owner.reshape(-1)
    return Lift(
        places=places,
        owner=owner,
        normals=unit(np.stack([np.bincount(owner, row) for row in patch.normals])),
        heights=np.bincount(owner, part.heights.at(patch.coordinates)) / np.bincount(owner),
        border=np.bincount(owner, patch.border) > 0,
    )


def _moved(part: Displaced, patch: Patch, lift: Lift, mapped: bool) -> Triangles:
    moved = lift.moved()
    surface = Surface(moved, patch.triangles, patch.coordinates, mapped)
    family = triangles_of(part.number, moved, surface, smooth=True)
    family.vertex_normals = _turned(patch, family.vertex_normals)
    return family


def _turned(patch: Patch, moved: Floats) -> Floats:
    """Unit normals at the corners (3, 3, T): the shape's own plus what the relief adds to the surface's."""
    own = patch.shading - smooth_normals(patch.positions, patch.triangles)
    return np.stack([unit(own[:, row] + corner) for row, corner in zip(patch.triangles, moved, strict=True)])


def _surface(number: int, shape: language.Shape, assets: AssetSource) -> Surface | None:
    """The shape as a coarse mesh; None for what is round."""
    match shape:
        case language.Ellipsoid() | language.Sphere():
            return None
        case language.Mesh() | language.MeshFile():
            return _mesh(number, shape, assets)
        case language.Triangle():
            rows, texture = np.array([[0], [1], [2]]), np.array(shape.uvs or CORNERS).T
            return Surface(columns(shape.vertices), rows, texture, shape.uvs is not None)
        case language.Rectangle() | language.Parallelogram():
            return _rectangle(shape)
        case _:
            assert_never(shape)


def _flat(shape: language.Shape, surface: Surface, count: int) -> Patch:
    """The fine mesh of a coarse one, each edge cut into `count`."""
    return _subdivided(surface, _normals(shape, surface), count, smooth=_smooth(shape))


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


def _mesh(number: int, shape: language.Mesh | language.MeshFile, assets: AssetSource) -> Surface:
    """A mesh in its place. Without texture coordinates, each triangle gets some of its own."""
    surface = surface_of(number, shape, assets)
    vertices, rows, texture = placed(surface.vertices, shape), surface.triangles, surface.texture
    if texture is None:
        vertices, texture = vertices[:, rows.T.reshape(-1)], np.tile(CORNERS.T, rows.shape[1])
        rows = np.arange(rows.size).reshape(-1, 3).T
    rows = rows[[0, 2, 1]] if mirrored(shape) else rows
    return Surface(vertices, rows, texture, surface.mapped)


def _rectangle(shape: language.Rectangle | language.Parallelogram) -> Surface:
    corner, first, second = rectangles.edges(shape)
    vertices = np.hstack((corner, corner + first, corner + second, corner + first + second))
    rows, texture = np.array([[0, 1], [1, 3], [2, 2]]), np.array([[0.0, 1, 0, 1], [0.0, 0, 1, 1]])
    return Surface(vertices, rows, texture, mapped=True)


def _subdivided(surface: Surface, normals: Floats, count: int, *, smooth: bool) -> Patch:
    """Every triangle cut into n * n, the same n for all, so that neighbours keep sharing vertices.

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
    sides = (third == 0, first == 0, second == 0)
    ends = zip(open_edges(surface), sides, strict=True)
    border = np.logical_or.reduce([edge[:, None] & side for edge, side in ends]).reshape(-1)
    return Patch(mean(surface.vertices), along, shading, mean(surface.texture), rows, border)


def _cells(numbers: Integers) -> Integers:
    """Triangles (3, n * n) of a triangular grid of vertex numbers, -1 beyond its long side."""
    here, right, up, across = numbers[:-1, :-1], numbers[1:, :-1], numbers[:-1, 1:], numbers[1:, 1:]
    lower = np.stack((here, right, up)).reshape(3, -1)
    upper = np.stack((right, across, up)).reshape(3, -1)
    return np.hstack((lower[:, lower.min(axis=0) >= 0], upper[:, upper.min(axis=0) >= 0]))


def _cuts(
    surfaces: Sequence[Surface | None], together: Sequence[Sequence[int]], camera: Pinhole, most: int
) -> Integers:
    """Parts (N,) that the edges of each surface are cut into: alike for neighbours of one relief."""
    flat = {i: surface for i, surface in enumerate(surfaces) if surface is not None}
    allowed, cuts = np.ones((2, len(surfaces)), dtype=np.int64)
    for i, surface in flat.items():
        allowed[i] = max(1, int(np.sqrt(most / surface.triangles.shape[1])))
        cuts[i] = min(int(np.ceil(_longest(surface, camera) / PIXELS)), allowed[i])
    for group in together:
        chosen = np.array([i for i in group if i in flat], dtype=np.int64)
        labels = neighbours([flat[i] for i in chosen.tolist()])
        for label in np.unique(labels):
            members = chosen[labels == label]
            cuts[members] = min(cuts[members].max(), allowed[members].min())
    return cuts


def _longest(surface: Surface, camera: Pinhole) -> float:
    corners = [surface.vertices[:, row] for row in surface.triangles]
    return max(float(_pixels(corners[i], corners[(i + 1) % 3], camera).max(initial=1.0)) for i in range(3))


def _pixels(start: Floats, end: Floats, camera: Pinhole) -> Floats:
    """Lengths of segments as the camera sees them from the nearer end, pixels."""
    nearest = np.minimum(lengths(start - camera.position), lengths(end - camera.position))
    length = lengths(end - start)
    # An edge through the camera would be infinitely many pixels long.
    away = np.maximum(nearest, length / 64)
    return length / np.where(away > 0, away, 1.0) / (2 * camera.half_height) * camera.height


def _round(shape: language.Shape, camera: Pinhole, assets: AssetSource, most: int) -> Patch:
    """A grid of longitudes and latitudes. Its first and last column, and each pole, are one place."""
    assert isinstance(shape, language.Ellipsoid | language.Sphere)
    family = ellipsoids.build([0], [shape], assets)
    axes, inverse = family.axes[:, :, 0], family.inverse[:, :, 0]
    radius = float(np.max([lengths(axis[:, None]) for axis in axes]))
    side = np.array([[radius], [0.0], [0.0]])
    half_round = np.pi * float(_pixels(family.centers, family.centers + side, camera).item())
    rows = max(3, min(int(np.ceil(half_round / PIXELS)), int(np.sqrt(most / 4))))
    coordinates, cells = _graticule(rows)
    if family.handedness().item() < 0:
        cells = cells[[0, 2, 1]]
    local = _on_sphere(coordinates)
    positions = family.centers + np.stack([dot(local, axes[:, i, None]) for i in range(3)])
    normals = unit(np.stack([dot(local, inverse[:, i, None]) for i in range(3)]))
    border = np.zeros(coordinates.shape[1], dtype=bool)
    return Patch(positions, normals, normals, coordinates, cells, border)


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
