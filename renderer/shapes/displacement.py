"""Displaced surfaces: fine meshes whose vertices are moved along the normal by a height map.

Cracks cannot open: vertices at the same point share one normal and one height, the means over their faces,
also along borders of different shapes (`borders`). Shading normals are kept, and turned with the surface, so
that a smooth mesh stays smooth, a flat one keeps its edges, and flat heights change nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, dot, lengths, put, taken, unit
from renderer.shapes import ellipsoids
from renderer.shapes.borders import EDGES, Lift, join, neighbours, open_edges
from renderer.shapes.coarse import Coarse, coarse_of
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.meshes import Surface, joined, place_numbers, smooth_normals, triangles_of, winding
from renderer.shapes.triangles import Triangles

EDGE_PIXELS = 2.0
"""Length of an edge of the fine mesh as seen by the camera, pixels, unless the limit says otherwise."""

MAX_TRIANGLES = 400_000
"""Most triangles of all displaced shapes of a scene, divided equally among them."""

TRIANGLES_AT_ONCE = 1 << 14
"""Triangles of small displaced meshes that are built at once: their arrays stay in cache."""

ROUND_SHAPES = (language.Ellipsoid, language.Sphere)


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
    """Fine meshes before they are moved, shape after shape.

    Attributes
    ----------
    positions, normals : (3, V) float64
        Normals of any length, along which the positions are moved.
    shading : (3, V) float64
        Unit normals that the shape is shaded with where it lies.
    coordinates : (2, V) float64
        Texture coordinates; vertices at one place may differ in them.
    shapes : (V,) int64
        Number of each vertex's shape in the scene.
    border : (V,) bool
        Whether the shape ends there.
    triangles : (3, T) int64
    """

    positions: Floats
    normals: Floats
    shading: Floats
    coordinates: Floats
    shapes: Integers
    border: Masks
    triangles: Integers


def build(parts: Sequence[Displaced], camera: Pinhole, assets: AssetSource) -> Triangles:
    """The family of all displaced shapes, in the order of the scene, fine enough for the camera."""
    relief, most = _Relief.of(parts), MAX_TRIANGLES // len(parts)
    bent = {part.number: part.shape for part in parts if isinstance(part.shape, ROUND_SHAPES)}
    flat = {part.number: part.shape for part in parts if part.number not in bent}
    families: list[Triangles] = []
    if flat:
        families += _of_flat(coarse_of([*flat], [*flat.values()], assets), relief, camera, most)
    if bent:
        families += _of_round(ellipsoids.build([*bent], [*bent.values()], assets), relief, camera, most)
    return joined(families)


def _of_flat(coarse: Coarse, relief: "_Relief", camera: Pinhole, most: int) -> Iterator[Triangles]:
    patches = list(_patches(coarse, _cuts(coarse, relief.numbers, camera, most)))
    lifts = [_lift(patch, relief) for patch in patches]
    join(lifts, relief.numbers)
    mapped = np.zeros(relief.numbers.size, dtype=bool)
    mapped[coarse.shapes] = coarse.mapped
    for patch, lift in zip(patches, lifts, strict=True):
        yield _moved(patch, lift, mapped)


def _of_round(family: Ellipsoids, relief: "_Relief", camera: Pinhole, most: int) -> Iterator[Triangles]:
    for patch in _grids(family, _rows(family, camera, most)):
        yield _moved(patch, _lift(patch, relief), np.ones(relief.numbers.size, dtype=bool))


@dataclass(frozen=True, slots=True, eq=False)
class _Relief:
    """Distinct heights that move the shapes of a scene."""

    heights: Sequence[Heights]
    numbers: Integers

    @classmethod
    def of(cls, parts: Sequence[Displaced]) -> "_Relief":
        """Heights and the index of each displaced shape's; `numbers` is 0 for others."""
        heights = list({id(part.heights): part.heights for part in parts}.values())
        indices = {id(each): i for i, each in enumerate(heights)}
        numbers = np.zeros(1 + max(part.number for part in parts), dtype=np.int64)
        numbers[[part.number for part in parts]] = [indices[id(part.heights)] for part in parts]
        return cls(heights, numbers)

    def at(self, shapes: Integers, coordinates: Floats) -> Floats:
        """Heights (V,) of shapes (V,) at texture coordinates (2, V), scene units."""
        which = self.numbers[shapes]
        result = np.empty(which.size)
        for number in np.unique(which).tolist():
            chosen = np.flatnonzero(which == number)
            result[chosen] = self.heights[number].at(taken(coordinates, chosen))
        return result


def _lift(patch: Patch, relief: _Relief) -> Lift:
    owner = place_numbers(patch.positions, patch.shapes)
    count = np.bincount(owner)
    positions, shapes = np.empty((3, count.size)), np.empty(count.size, dtype=np.int64)
    put(positions, owner, patch.positions)
    shapes[owner] = patch.shapes
    return Lift(
        positions=positions,
        shapes=shapes,
        owner=owner,
        normals=unit(np.stack([np.bincount(owner, row) for row in patch.normals])),
        heights=np.bincount(owner, relief.at(patch.shapes, patch.coordinates)) / count,
        border=np.bincount(owner, patch.border) > 0,
    )


def _moved(patch: Patch, lift: Lift, mapped: Masks) -> Triangles:
    """The fine triangles in their places; `mapped` (shapes,) is whether texture coordinates were given."""
    vertices, every = lift.moved(), np.ones_like(mapped)
    surface = Surface(vertices, patch.triangles, patch.coordinates, patch.shapes, every)
    family = triangles_of(np.arange(mapped.size), vertices, surface, smooth=every)
    own = patch.shading - smooth_normals(patch.positions, patch.triangles, lift.owner)
    family.vertex_normals = _turned(surface.corners(own), family.vertex_normals)
    family.mapped = mapped[surface.meshes]
    return family


def _turned(own: Floats, moved: Floats) -> Floats:
    """Unit normals at the corners (3, 3, T): the shape's own, plus the relief's change."""
    return np.stack([unit(corner + after) for corner, after in zip(own, moved, strict=True)])


def _portions(shapes: Integers, each: int) -> list[Integers]:
    """Portions of triangles (T,), sorted by shape, none divided; each triangle becomes `each` fine ones."""
    begins = np.searchsorted(shapes, shapes)
    return np.split(np.arange(shapes.size), np.flatnonzero(np.diff(begins * each // TRIANGLES_AT_ONCE)) + 1)


def _patches(coarse: Coarse, cuts: Integers) -> Iterator[Patch]:
    """Fine meshes of coarse ones, the edges of each shape (shapes,) cut into so many parts."""
    cuts = cuts[coarse.shapes]
    for count in np.unique(cuts).tolist():
        alike = coarse.part(np.flatnonzero(cuts == count))
        for chosen in _portions(alike.shapes, count**2):
            yield _subdivided(alike.part(chosen), count)


def _subdivided(coarse: Coarse, count: int) -> Patch:
    """Every triangle cut into n * n, the same n for all, so that neighbours keep sharing vertices.

    A vertex on an edge is the sum of two products, in whichever triangle: the same bits from both sides.
    """
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
    inside = i + j <= count
    second, third = i[inside] / count, j[inside] / count
    first = (count - i[inside] - j[inside]) / count

    def mean(corners: Floats) -> Floats:
        a, b, c = corners[..., None]
        return (a * first + b * second + c * third).reshape(len(a), -1)

    numbers = np.full(inside.shape, -1)
    numbers[inside] = np.arange(first.size)
    each = _cells(numbers)
    offsets = np.arange(coarse.shapes.size) * first.size
    along = mean(coarse.directions)
    smooth = coarse.smooth.repeat(first.size)
    sides = (third == 0, first == 0, second == 0)
    ends = zip(open_edges(coarse.corners, coarse.shapes), sides, strict=True)
    return Patch(
        positions=mean(coarse.corners),
        normals=along,
        shading=np.where(smooth, unit(along), coarse.normals.repeat(first.size, axis=1)),
        coordinates=mean(coarse.texture),
        shapes=coarse.shapes.repeat(first.size),
        border=np.logical_or.reduce([edge[:, None] & side for edge, side in ends]).reshape(-1),
        triangles=(each[:, None, :] + offsets[None, :, None]).reshape(3, -1),
    )


def _cells(numbers: Integers) -> Integers:
    """Triangles (3, n * n) of a triangular grid of vertex numbers, -1 beyond its long side."""
    here, right, up, across = numbers[:-1, :-1], numbers[1:, :-1], numbers[:-1, 1:], numbers[1:, 1:]
    lower = np.stack((here, right, up)).reshape(3, -1)
    upper = np.stack((right, across, up)).reshape(3, -1)
    return np.hstack((lower[:, lower.min(axis=0) >= 0], upper[:, upper.min(axis=0) >= 0]))


def _cuts(coarse: Coarse, reliefs: Integers, camera: Pinhole, most: int) -> Integers:
    """Parts (shapes,) that the edges of each shape are cut into: alike for neighbours of one relief."""
    counts = np.bincount(coarse.shapes, minlength=reliefs.size)
    allowed = np.maximum(1, np.sqrt(most / np.maximum(1, counts)).astype(np.int64))
    pixels = np.ones(reliefs.size)
    for start, end in EDGES:
        edges = _pixels(coarse.corners[start], coarse.corners[end], camera)
        np.maximum.at(pixels, coarse.shapes, edges)
    cuts = np.minimum(np.ceil(pixels / EDGE_PIXELS), allowed).astype(np.int64)
    labels = neighbours(coarse.corners, coarse.shapes, reliefs)
    wanted, least = np.zeros_like(cuts), np.full_like(cuts, MAX_TRIANGLES)
    np.maximum.at(wanted, labels, cuts)
    np.minimum.at(least, labels, allowed)
    return np.minimum(wanted, least)[labels]


def _pixels(start: Floats, end: Floats, camera: Pinhole) -> Floats:
    """Lengths of segments as the camera sees them from the nearer end, pixels."""
    nearest = np.minimum(lengths(start - camera.position), lengths(end - camera.position))
    length = lengths(end - start)
    # An edge through the camera would be infinitely many pixels long.
    away = np.maximum(nearest, length / 64)
    return length / np.where(away > 0, away, 1.0) / (2 * camera.half_height) * camera.height


def _grids(family: Ellipsoids, rows: Integers) -> Iterator[Patch]:
    """Fine meshes of ellipsoids, each a grid with this number of rows (K,)."""
    for count in np.unique(rows).tolist():
        alike = family.part(np.flatnonzero(rows == count))
        for chosen in _portions(np.arange(alike.numbers.size), 4 * count**2):
            yield _graticules(alike.part(chosen), count)


def _rows(family: Ellipsoids, camera: Pinhole, most: int) -> Integers:
    """Rows (K,) of the grid of each ellipsoid."""
    radius = np.max([lengths(axis) for axis in family.axes], axis=0)
    side = np.stack((radius, np.zeros_like(radius), np.zeros_like(radius)))
    half_round = np.pi * _pixels(family.centers, family.centers + side, camera)
    finest = int(np.sqrt(most / 4))
    return np.maximum(3, np.minimum(np.ceil(half_round / EDGE_PIXELS), finest)).astype(np.int64)


def _graticules(family: Ellipsoids, rows: int) -> Patch:
    """Longitudes and so many rows of latitudes. Their first and last column, and each pole, are one place."""
    coordinates, cells = _graticule(rows)
    local, vertices, count = _on_sphere(coordinates)[:, None], coordinates.shape[1], family.numbers.size

    def along(vectors: Floats) -> Floats:
        """Sums (3, K, V) of K times three vectors by the coordinates of the V vertices."""
        return np.stack([dot(local, vectors[:, i, :, None]) for i in range(3)])

    normals = unit(along(family.inverse).reshape(3, -1))
    # Left-handed axes turn the cells over.
    turned = np.take_along_axis(cells[:, None], winding(family.handedness() < 0).transpose(0, 2, 1), axis=0)
    offsets = np.arange(count)[:, None] * vertices
    return Patch(
        positions=(family.centers[:, :, None] + along(family.axes)).reshape(3, -1),
        normals=normals,
        shading=normals,
        coordinates=np.tile(coordinates, count),
        shapes=family.numbers.repeat(vertices),
        border=np.zeros(count * vertices, dtype=bool),
        triangles=(turned + offsets).reshape(3, -1),
    )


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
