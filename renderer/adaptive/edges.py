"""Edges of flat shapes and silhouettes of triangle meshes on the picture.

Pixels that they cross need not differ from any neighbour. Two silhouettes that face away from each other and
are close bound thin shapes and thin gaps; single triangles of a mesh tell nothing, as most are smaller than a
pixel and part of something larger.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.accelerators.trees import in_tree
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, taken
from renderer.math.streams import keys
from renderer.shapes import Family
from renderer.shapes.triangles import Triangles

STEP = 0.5
"""Spacing of the positions along an edge or a shadow, pixels: it may cross no more than a corner of a pixel
unseen."""

NEXT = np.array([1, 2, 0])
"""The vertex after each vertex of a triangle."""

FACING_AWAY = 1.2
"""Length of the sum of outward vectors, each as long as its edge, over three by three cells, in sides of a
cell, below which silhouettes in them face away from each other. A single one crosses two cells or three,
however much it is folded: that of a fine mesh zigzags between triangles that are seen edge-on."""


@dataclass(frozen=True, slots=True, eq=False)
class EdgePositions:
    """Positions on the picture along edges, a `STEP` or less apart.

    Attributes
    ----------
    pixels : (2, N) int64
        Column and row.
    edges : (N,) int64
        Number of the edge of each.
    depths : (N,) float64
        Along the view, scene units.
    lengths : (N,) float64
        Length of its edge that each represents, pixels.
    """

    pixels: Integers
    edges: Integers
    depths: Floats
    lengths: Floats

    def select(self, chosen: Masks) -> "EdgePositions":
        """Select by a mask (N,)."""
        return EdgePositions(
            self.pixels[:, chosen], self.edges[chosen], self.depths[chosen], self.lengths[chosen]
        )


def edge_pixels(camera: Pinhole, families: Iterable[Family]) -> Integers:
    """Pixels that edges of flat shapes cross, (2, N): triangles in trees are parts of larger shapes."""
    found = [np.zeros((2, 0), dtype=np.int64)]
    found += [
        positions_along(camera, *edges_of(family)).pixels
        for family in families
        if family.edges() and not in_tree(family)
    ]
    return np.hstack(found)


def edges_of(family: Family) -> tuple[Floats, Floats]:
    """Either end of the edges of flat shapes, (3, M) each."""
    corners, pairs = family.corners(), family.edges()
    first, second = (np.hstack([corners[pair[end]] for pair in pairs]) for end in (0, 1))
    return first, second


def positions_along(camera: Pinhole, first: Floats, second: Floats) -> EdgePositions:
    """Positions along the edges from `first` to `second`, (3, M) each, within the view."""
    starts, ends = _inside(view_from(camera, first), view_from(camera, second))
    seen = np.flatnonzero(starts[2] > 0)
    starts, ends = taken(starts, seen), taken(ends, seen)
    first, second = (_on_picture(camera, place) for place in (starts, ends))
    apart = np.hypot(*(second - first))
    counts = (apart / STEP).astype(np.int64) + 2
    edges = np.arange(seen.size).repeat(counts)
    steps = (np.arange(edges.size) - (np.cumsum(counts) - counts)[edges]) / (counts - 1)[edges]
    positions = taken(first, edges) + steps * taken(second - first, edges)
    size = np.array([[camera.width], [camera.height]])
    # Reciprocal depth is linear on the picture.
    depths = 1 / ((1 - steps) / starts[2][edges] + steps / ends[2][edges])
    pixels = np.clip(np.floor(positions).astype(np.int64), 0, size - 1)
    return EdgePositions(pixels, seen[edges], depths, (apart / counts)[edges])


def _inside(starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """The parts of edges (3, K) within the view |x| <= depth, |y| <= depth; depth 0 where there is none.

    Clipped at its four sides, each where a linear function is positive (Liang, Barsky 1984).
    """
    enters, leaves = np.zeros(starts.shape[1]), np.ones(starts.shape[1])
    for axis, side in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)):
        one, other = (place[2] + side * place[axis] for place in (starts, ends))
        crossing = np.divide(one, one - other, out=np.zeros_like(one), where=one != other)
        enters = np.where(one < 0, np.maximum(enters, crossing), enters)
        leaves = np.where(other < 0, np.minimum(leaves, crossing), leaves)
        leaves = np.where((one < 0) & (other < 0), -1.0, leaves)
    seen: Masks = enters < leaves
    along = ends - starts
    return (starts + enters * along) * seen, (starts + leaves * along) * seen


def project(camera: Pinhole, positions: Floats) -> tuple[Floats, Floats, Masks]:
    """Column and row (2, M) of points (3, M), their depths (M,) along the view, and which are in the view."""
    seen = view_from(camera, positions)
    inside: Masks = (np.abs(seen[:2]) < seen[2]).all(axis=0)
    return _on_picture(camera, np.where(inside, seen, 1.0)), seen[2], inside


def view_from(camera: Pinhole, positions: Floats) -> Floats:
    """Right and up, by half the width and height of the picture at the distance 1, and depth, (3, M)."""
    away = positions - camera.position
    right, up = dot(away, camera.right) / camera.half_width, dot(away, camera.up) / camera.half_height
    return np.stack((right, up, dot(away, camera.forward)))


def _on_picture(camera: Pinhole, positions: Floats) -> Floats:
    """Column and row, (2, M), of points in the view, given as right, up and depth by `view_from`.

    They lie no farther aside than deep, but for the rounding of an end that is level with the camera.
    """
    x, y = positions[:2] / np.maximum(np.abs(positions).max(axis=0), np.finfo(np.float64).tiny)
    return np.stack(((x + 1) / 2 * camera.width, (1 - y) / 2 * camera.height))


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Silhouette edges (M,) of flat shapes.

    Attributes
    ----------
    starts, ends, inner : (3, M) float64
        Either end, and a point of the shape as far beside them as it is wide: the third vertex of triangles.
    """

    starts: Floats
    ends: Floats
    inner: Floats

    def part(self, chosen: Integers) -> "Outline":
        """Select by indices."""
        return Outline(taken(self.starts, chosen), taken(self.ends, chosen), taken(self.inner, chosen))


def outline_of(family: Family, place: Floats, weight: float = 1.0) -> Outline:
    """Silhouette of flat shapes from a position (3, 1), or from a direction with weight 0."""
    if isinstance(family, Triangles):
        return _silhouette(family.vertices, place - weight * family.vertices[0])
    starts, ends = edges_of(family)
    return Outline(starts, ends, 2 * np.tile(family.corners().mean(axis=0), len(family.edges())) - starts)


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
