"""Projected edges of flat shapes: pixels that they cross need not differ from any neighbour."""

from dataclasses import dataclass

import numpy as np

from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, dot, taken
from renderer.shapes.family import Hulls

STEP = 0.5
"""Spacing of the positions along an edge, pixels: an edge may cross no more than a corner of a pixel
unseen."""


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


def edge_pixels(camera: Pinhole, hulls: Hulls) -> Integers:
    """Pixels that edges of shapes cross, (2, N): column and row."""
    corners, pairs = hulls.corners, hulls.edges
    if not pairs:
        return np.zeros((2, 0), dtype=np.int64)
    first, second = (np.hstack([corners[pair[end]] for pair in pairs]) for end in (0, 1))
    return positions_along(camera, first, second).pixels


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
