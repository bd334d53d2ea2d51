"""Grids over the picture with the triangles that a pinhole's rays may hit in each cell.

A pinhole's rays are points of the screen, and the triangles' projections never change. They are bounded here,
rounding included, and the exact test decides.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, taken
from renderer.shapes.family import Outline
from renderer.shapes.triangles import Triangles

MIN_DEPTH_SHARE = 2.0**-8
"""A vertex is clearly ahead of the camera if its depth is more than this share of its distance. Its place on
the screen is then within some hundred roundings; other triangles go through the tree."""

PROJECTION_ERROR = 2.0**-36
"""Relative room around a projection and a depth: thousands of roundings of a clear vertex."""

EDGE_FUNCTION_ERROR = 2.0**-20
"""Relative error, with room, of an edge function in float32: 2**-24 for each of its roundings."""

MAX_CELLS_PER_AXIS = 3
"""Cells that a triangle touches along an axis, at most: cells are at least half as wide as it is."""

MIN_GRID_SHARE = 1 / 32
"""A grid with a smaller share of the triangles is merged with the next coarser one, since each costs a ray a
look-up. With larger shares, such as an eighth, rays test more triangles and take longer."""

MAX_SLACK = 1 / 4
"""With more slack, no point is certainly inside."""

MIN_CELL_EXPONENT = -16
"""Triangles smaller than 2**-16 pixels share cells of that size."""

PROJECTED_TRIANGLES = 65536
"""Triangles projected at once, so that memory does not grow with the mesh."""

EXTRA_TRIANGLES = 256
"""Triangles added to a grid's own when its number of cells is bounded: small grids may be fine."""

CELLS_PER_TRIANGLE = 16
"""Cells a triangle, at most, so that a grid takes no more memory than what it holds."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Triangles of about one size on the screen, cell by cell.

    Attributes
    ----------
    cell : float
        Side of a cell, pixels.
    left, bottom : int
        The first column and row of cells.
    columns, rows : int
        Numbers of columns and rows.
    starts : (cells + 1,) int64
        Index in `items` of each cell's first triangle.
    items : (entries,) int64
        Places in the arrays of `ScreenTriangles`.
    """

    cell: float
    left: int
    bottom: int
    columns: int
    rows: int
    starts: Integers
    items: Integers

    def candidates(self, x: Floats, y: Floats) -> tuple[Integers, Integers]:
        """Pairs of ray and triangle, (P,) each and sorted by ray, of rays through places (N,), pixels."""
        across = np.floor(x * (1 / self.cell)).astype(np.int64) - self.left
        up = np.floor(y * (1 / self.cell)).astype(np.int64) - self.bottom
        inside = (across >= 0) & (across < self.columns) & (up >= 0) & (up < self.rows)
        rays = np.flatnonzero(inside)
        cells = up[rays] * self.columns + across[rays]
        first = self.starts[cells]
        counts = self.starts[cells + 1] - first
        ends = np.cumsum(counts)
        entries = np.arange(ends[-1] if ends.size else 0) + (first - ends + counts).repeat(counts)
        return rays.repeat(counts), self.items[entries]


@dataclass(frozen=True, slots=True, eq=False)
class ScreenTriangles:
    """K triangles in front of a pinhole camera, as it sees them.

    Attributes
    ----------
    numbers : (K,) int64
        Their numbers in the family.
    edges : (6, K) float32
        Weights of the second and third vertex at a place (x, y) in pixels: a x + b y + c each.
    slack : (K,) float32
        Bound on the rounding of a weight; inf for triangles seen edge-on.
    nearest, farthest : (K,) float64
        Least and greatest depth, with room.
    grids : tuple of Grid
    others : (M,) int64
        Numbers of triangles that may be seen, but are not clearly in front of the camera.
    pixel : float
        Side of a pixel on the screen at distance 1.
    """

    numbers: Integers
    edges: NDArray[np.float32]
    slack: NDArray[np.float32]
    nearest: Floats
    farthest: Floats
    grids: tuple[Grid, ...]
    others: Integers
    pixel: float

    def inside(self, x: Floats, y: Floats, items: Integers) -> tuple[Masks, Masks]:
        """Whether places (P,) may lie in triangles (P,), and whether they surely do."""
        x, y = x.astype(np.float32), y.astype(np.float32)
        a, b, c, d, e, f = (np.take(row, items) for row in self.edges)
        second, third = a * x + b * y + c, d * x + e * y + f
        least = np.minimum(np.minimum(second, third), 1 - second - third)
        slack = np.take(self.slack, items)
        return least >= -slack, least >= slack


def screen_triangles(family: Triangles, camera: Pinhole) -> ScreenTriangles:
    """Project the triangles of a family."""
    pixel = 2 * camera.half_height / camera.height
    half = np.array([[camera.half_width], [camera.half_height]]) / pixel
    parts = [
        _projected(family.vertices[:, :, start : start + PROJECTED_TRIANGLES], camera, pixel, half)
        for start in range(0, family.numbers.size, PROJECTED_TRIANGLES)
    ]
    counts = np.cumsum([0] + [part.seen.size for part in parts])
    numbers = np.concatenate([part.numbers + start for part, start in zip(parts, counts, strict=False)])
    seen = np.concatenate([part.seen for part in parts])
    low, high, edges = (
        np.concatenate([getattr(part, name) for part in parts], axis=1) for name in ("low", "high", "edges")
    )
    slack, nearest, farthest = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("slack", "nearest", "farthest")
    )
    seen[numbers] = False
    grids = tuple(_grids(low, high)) if numbers.size else ()
    return ScreenTriangles(numbers, edges, slack, nearest, farthest, grids, np.flatnonzero(seen), pixel)


@dataclass(frozen=True, slots=True, eq=False)
class _Projected:
    """Some triangles of a family on the screen.

    Attributes
    ----------
    seen : (T,) bool
        Triangles that the camera may see.
    numbers : (k,) int64
        Those that are clearly ahead; the other arrays are about these.
    low, high : (2, k) float64
        Bounds, pixels.
    edges, slack, nearest, farthest
        As of `ScreenTriangles`.
    """

    seen: Masks
    numbers: Integers
    low: Floats
    high: Floats
    edges: NDArray[np.float32]
    slack: NDArray[np.float32]
    nearest: Floats
    farthest: Floats


def _projected(vertices: Floats, camera: Pinhole, pixel: float, half: Floats) -> _Projected:
    """Project triangles with vertices (3, 3, T) onto a screen of half sides (2, 1), pixels."""
    outline = Outline.of(vertices, camera)
    width, height = camera.half_width, camera.half_height
    seen = outline.inside(np.array([-width, width, -height, height]))
    distance = np.abs(outline.right) + np.abs(outline.up) + np.abs(outline.forward)
    numbers = np.flatnonzero(seen & (outline.forward > MIN_DEPTH_SHARE * distance).all(axis=0))
    depth = taken(outline.forward, numbers)
    x, y = (taken(along, numbers) / depth / pixel for along in (outline.right, outline.up))
    low, high = _bounds(np.stack((x, y)), 1 / pixel, half)
    nearest, farthest = depth.min(axis=0) * (1 - PROJECTION_ERROR), depth.max(axis=0) * (1 + PROJECTION_ERROR)
    return _Projected(seen, numbers, low, high, *_edge_functions(x, y, half), nearest, farthest)


def _edge_functions(x: Floats, y: Floats, half: Floats) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """`edges` and `slack` of triangles with vertices (3, K) on a screen of half sides (2, 1), pixels."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        twice = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
        slopes = np.stack((y[2] - y[0], x[0] - x[2], y[0] - y[1], x[1] - x[0])) / twice
        rows = [(a, b, -(a * x[0] + b * y[0])) for a, b in (slopes[:2], slopes[2:])]
        slack = sum(
            EDGE_FUNCTION_ERROR * (np.abs(a) * half[0] + np.abs(b) * half[1] + np.abs(c)) for a, b, c in rows
        )
    # Also where it is no number. Of such a triangle float32 cannot say what lies inside.
    unsure = ~(slack < MAX_SLACK)
    edges = np.where(unsure, 0.0, np.concatenate(rows).reshape(6, -1))
    return edges.astype(np.float32), np.where(unsure, np.inf, slack).astype(np.float32)


def _bounds(corners: Floats, unit: float, half: Floats) -> tuple[Floats, Floats]:
    """Least and greatest corners (2, K) of triangles (2, 3, K) on a screen of half sides (2, 1), pixels."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    low -= PROJECTION_ERROR * (np.abs(low) + unit)
    high += PROJECTION_ERROR * (np.abs(high) + unit)
    edge = half * (1 + PROJECTION_ERROR) + PROJECTION_ERROR * unit
    return np.clip(low, -edge, edge), np.clip(high, -edge, edge)


def _grids(low: Floats, high: Floats) -> Iterator[Grid]:
    """Grids of the triangles with bounds (2, K), from the smallest to the largest."""
    # A size is below 2**power and at least half of that: 2**(power - 1) is the side of a cell.
    powers = np.maximum(np.frexp((high - low).max(axis=0))[1], MIN_CELL_EXPONENT)
    chosen = np.arange(0)
    for power in np.unique(powers).tolist():
        chosen = np.concatenate((chosen, np.flatnonzero(powers == power)))
        if chosen.size >= MIN_GRID_SHARE * powers.size or power == powers.max():
            yield _grid(chosen, low[:, chosen], high[:, chosen], 2.0 ** (power - 1))
            chosen = chosen[:0]


def _grid(chosen: Integers, low: Floats, high: Floats, cell: float) -> Grid:
    """One grid of triangles `chosen` (k,) with bounds (2, k)."""
    extent = (high.max(axis=1) - low.min(axis=1)).max()
    while (extent / cell + 1) ** 2 > CELLS_PER_TRIANGLE * (chosen.size + EXTRA_TRIANGLES):
        cell *= 2
    begins, ends = (np.floor(side / cell).astype(np.int64) for side in (low, high))
    corner = begins.min(axis=1, keepdims=True)
    begins, ends = begins - corner, ends - corner
    left, bottom = corner.ravel().tolist()
    columns, rows = (ends.max(axis=1) + 1).tolist()
    keys = []
    for step in np.ndindex(MAX_CELLS_PER_AXIS, MAX_CELLS_PER_AXIS):
        across, up = begins[0] + step[0], begins[1] + step[1]
        touched = np.flatnonzero((across <= ends[0]) & (up <= ends[1]))
        keys.append((up[touched] * columns + across[touched]) * chosen.size + touched)
    # One sort of a number made of both is faster than one of indices.
    cells, items = np.divmod(np.sort(np.concatenate(keys)), chosen.size)
    starts = np.concatenate(([0], np.cumsum(np.bincount(cells, minlength=columns * rows))))
    return Grid(cell, left, bottom, columns, rows, starts, chosen[items])
