"""Silhouettes of triangle meshes, and where two of them that face away from each other are close.

Such pairs bound thin shapes and thin gaps. Single triangles of a mesh tell nothing, as most are smaller than
a pixel and part of something larger.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.edges import EdgePositions, positions_along
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, taken
from renderer.math.streams import keys
from renderer.shapes import Family
from renderer.shapes.triangles import Triangles

NEXT = np.array([1, 2, 0])
"""The vertex after each vertex of a triangle."""

FACING_AWAY = 1.2
"""Length of the sum of outward vectors, each as long as its edge, over three by three cells, in sides of a
cell, below which silhouettes in them face away from each other. A single one crosses two cells or three,
however much it is folded: that of a fine mesh zigzags between triangles that are seen edge-on."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Silhouette edges (M,) of flat shapes.

    Attributes
    ----------
    starts, ends, inner : (3, M) float64
        Either end, and the third vertex of the triangle.
    """

    starts: Floats
    ends: Floats
    inner: Floats


def outline_of(family: Family, place: Floats, weight: float = 1.0) -> Outline:
    """Silhouette of flat shapes from a position (3, 1), or from a direction with weight 0."""
    if isinstance(family, Triangles):
        return _silhouette(family.vertices, place - weight * family.vertices[0])
    hulls = family.hulls()
    starts, ends = (np.hstack([hulls.corners[pair[end]] for pair in hulls.edges]) for end in (0, 1))
    return Outline(starts, ends, np.tile(hulls.corners.mean(axis=0), len(hulls.edges)))


def _silhouette(vertices: Floats, towards: Floats) -> Outline:
    """Edges of triangles (3, 3, K) between faces turned to the viewer and away, and those of open surfaces.

    `towards` (3, K) leads from their first vertices to the viewer.
    """
    alone, pairs, alike = _adjacency(vertices)
    a, b, c = vertices
    faces = np.sign(dot(cross(b - a, c - a), towards))
    one, other = (faces[side % faces.size] for side in pairs)
    turned = np.where(alike, one * other, -one * other)
    corner, triangle = np.divmod(np.concatenate((alone, pairs[0][turned >= 0])), faces.size)
    return Outline(*(np.ascontiguousarray(vertices[(corner + step) % 3, :, triangle].T) for step in range(3)))


def _adjacency(vertices: Floats) -> tuple[Integers, Integers, Masks]:
    """Adjacency of triangles (3, 3, K); vertices at equal positions are identified.

    Edge j of triangle k has the number j K + k. Edges (A,) of one triangle or of more than two; edges (2, B)
    of two, with their numbers in either; and whether both traverse it in the same direction (B,), unlike
    those of an oriented surface.
    """
    names = _names(vertices)
    after = names[NEXT]
    both = (names + after).ravel()
    order = np.argsort(both, kind="stable")
    fresh = np.flatnonzero(np.diff(both[order], prepend=both[order[:1]] + np.uint64(1)))
    counts = np.diff(fresh, append=order.size)
    first = fresh[counts == 2]
    pairs = np.stack((order[first], order[first + 1]))
    rising = (names < after).ravel()
    return order[(counts != 2).repeat(counts)], pairs, rising[pairs[0]] == rising[pairs[1]]


def _names(vertices: Floats) -> NDArray[np.uint64]:
    """Hash of each vertex's position, (3, K)."""
    x, y, z = np.ascontiguousarray((vertices + 0.0).transpose(1, 0, 2)).view(np.uint64)
    return keys(0, x, y, z)


def thin_positions(camera: Pinhole, outline: Outline, within: int) -> EdgePositions:
    """Positions along a silhouette with another one facing away about `within` pixels beside them."""
    positions = positions_along(camera, outline.starts, outline.ends)
    rows, columns = -(-camera.height // within), -(-camera.width // within)
    cells = positions.pixels[1] // within * columns + positions.pixels[0] // within
    across, along = taken(_outward(camera, outline), positions.edges) * positions.lengths

    def around(values: Floats) -> Floats:
        """Sums over the positions in each cell and the eight cells around it."""
        padded = np.pad(np.bincount(cells, values, rows * columns).reshape(rows, columns), 1)
        across = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
        return (across[:-2] + across[1:-1] + across[2:]).ravel()

    return positions.select((np.hypot(around(across), around(along)) < FACING_AWAY * within)[cells])


def _outward(camera: Pinhole, outline: Outline) -> Floats:
    """Unit vectors (2, M) on the picture, normal to edges and away from their triangles."""
    starts, ends, inner = (place - camera.position for place in (outline.starts, outline.ends, outline.inner))
    normal = cross(starts, ends)
    across, along = dot(normal, camera.right), -dot(normal, camera.up)
    length = np.hypot(across, along) * -np.sign(dot(normal, inner))
    return np.stack((across, along)) / np.where(length == 0, np.inf, length)
