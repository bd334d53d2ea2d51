"""A balanced tree of boxes, walked breadth first by many rays at once.

Every level is walked in one go over all (ray, node) pairs, so the number of NumPy calls depends on the depth
alone. Nodes have eight children: fewer levels, and each gather brings eight boxes that lie side by side.
"""

import math
from dataclasses import dataclass

import numpy as np

from renderer.arrays import Floats, Integers, Masks
from renderer.numerics import gamma

LEAF = 4
"""Items in a leaf, at most."""

FAN = 3
"""Binary splits a level: 2**3 children a node."""

WIDENING = gamma(16)
"""Share of its longest side by which a box is widened on each."""

AHEAD = 1 + gamma(32)
"""A hit is not farther in front of the box around it than this, in shares of its distance."""

NOTHING = -1
"""Item number of an empty place in a leaf."""


@dataclass(frozen=True, slots=True)
class Level:
    """Boxes of the children of all nodes of a level, (3, nodes, children) each."""

    low: Floats
    high: Floats

    @property
    def children(self) -> int:
        """Children a node."""
        return self.low.shape[2]


@dataclass(frozen=True, slots=True)
class Bvh:
    """The tree.

    Attributes
    ----------
    levels : tuple of Level
        From the root down; child c of node n is node n * children + c of the next level, in the end a leaf.
    items : (leaves, m) int64
        Item numbers, `NOTHING` in empty places.
    """

    levels: tuple[Level, ...]
    items: Integers


def build(low: Floats, high: Floats) -> Bvh:
    """Split boxes (3, T) at the median along the longest side, level by level.

    Splitting by number keeps the tree balanced and the depth bounded whatever the boxes are: flat, points,
    or all in one place. Cost T log T.

    Boxes are widened by the rounding of a test of what they hold, which may find a hit just beyond them.
    """
    count = low.shape[1]
    slack = WIDENING * (high - low).max(axis=0)
    low, high = np.nextafter(low - slack, -np.inf), np.nextafter(high + slack, np.inf)
    splits = max(0, math.ceil(math.log2(max(1, count) / LEAF)))
    width = -(-count // (1 << splits))
    order = _sorted_by_medians((low + high) / 2, splits, width)
    items = order.reshape(1 << splits, width)
    empty = items == NOTHING
    leaf_low = np.where(empty, np.inf, low[:, items]).min(axis=2)
    leaf_high = np.where(empty, -np.inf, high[:, items]).max(axis=2)
    return Bvh(_levels(leaf_low, leaf_high, splits), items)


def _sorted_by_medians(centers: Floats, splits: int, width: int) -> Integers:
    count = centers.shape[1]
    order = np.full(width << splits, NOTHING, dtype=np.int64)
    order[:count] = np.arange(count)
    padded = np.concatenate((centers, np.full((3, 1), np.inf)), axis=1)
    for level in range(splits):
        rows = order.reshape(1 << level, -1)
        places = padded[:, rows]
        known = np.isfinite(places)
        extent = np.where(known, places, -np.inf).max(axis=2) - np.where(known, places, np.inf).min(axis=2)
        axis = np.argmax(extent, axis=0)
        keys = np.take_along_axis(places, axis[None, :, None], axis=0)[0]
        # Empty places go to both halves in turns, so that no leaf is left with nothing else.
        empty = rows == NOTHING
        keys[empty] = np.where(np.cumsum(empty, axis=1) % 2, np.inf, -np.inf)[empty]
        half = np.argpartition(keys, rows.shape[1] // 2 - 1, axis=1)
        order = np.take_along_axis(rows, half, axis=1).reshape(-1)
    return order


def _levels(low: Floats, high: Floats, splits: int) -> tuple[Level, ...]:
    """Boxes of all levels from those of the leaves; the root takes what is left of the splits."""
    levels: list[Level] = []
    while True:
        fan = min(FAN, splits)
        grouped_low, grouped_high = (part.reshape(3, -1, 1 << fan) for part in (low, high))
        levels.append(Level(np.ascontiguousarray(grouped_low), np.ascontiguousarray(grouped_high)))
        low, high = grouped_low.min(axis=2), grouped_high.max(axis=2)
        splits -= fan
        if splits <= 0:
            return tuple(reversed(levels))


@dataclass(frozen=True, slots=True)
class Visits:
    """Nodes that rays may meet, sorted by ray.

    Attributes
    ----------
    rays, nodes : (P,) int64
        Nodes of a level, in the end leaves.
    entries : (P,) float64
        Distance at which the ray enters the node's box.
    """

    rays: Integers
    nodes: Integers
    entries: Floats


def from_root(count: int) -> Visits:
    """Every one of `count` rays at the root."""
    rays = np.arange(count)
    return Visits(rays, np.zeros_like(rays), np.zeros(count))


def visits_of_rays(
    levels: tuple[Level, ...], origins: Floats, directions: Floats, t: Floats, start: Visits
) -> Visits:
    """Nodes below the given levels that rays (3, N) may meet before t (N,); never leaves out one with a hit.

    Slabs with fmin and fmax, which drop the NaN of a ray in a slab's plane, and a far side moved out by
    twice the rounding of the test (Ize 2013, "Robust BVH ray traversal").
    """
    rays, nodes, entries = start.rays, start.nodes, start.entries
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = 1 / directions
        for level in levels:
            begin = origins if origins.shape[1] == 1 else origins[:, rays]
            near, far = _slabs(level, nodes, begin, inverse[:, rays])
            hit = (near <= far * (1 + 2 * gamma(3))) & (far >= 0) & (near <= t[rays, None] * AHEAD)
            pair, child = np.nonzero(hit)
            rays, nodes, entries = rays[pair], nodes[pair] * level.children + child, near[pair, child]
    return Visits(rays, nodes, entries)


def _slabs(level: Level, nodes: Integers, origins: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Where rays enter and leave the children's boxes, (P, children) each."""
    near = np.full((nodes.size, level.children), -np.inf)
    far = np.full(near.shape, np.inf)
    for axis in range(3):
        origin, slope = origins[axis][:, None], inverse[axis][:, None]
        first = np.take(level.low[axis], nodes, axis=0)
        second = np.take(level.high[axis], nodes, axis=0)
        for side in (first, second):
            np.subtract(side, origin, out=side)
            np.multiply(side, slope, out=side)
        np.fmax(near, np.fmin(first, second), out=near)
        np.fmin(far, np.fmax(first, second, out=first), out=far)
    return near, far


def visits_of_shafts(
    levels: tuple[Level, ...], points: Floats, low: Floats, high: Floats, weight: float, start: Visits
) -> Visits:
    """Nodes below the given levels that may lie between points (3, N) and a light.

    The light is within the bounds low..high, (3, 1).

    A place on a segment is p + s (q - p), 0 <= s <= 1: on every axis between p + s (low - p) and
    p + s (high - p). A box is left out if no single s brings these bounds into it on all three axes. For a
    light at infinity, weight 0, q - p is the direction itself and s has no end.
    """
    rays, nodes = start.rays, start.nodes
    towards_low, towards_high = low - weight * points, high - weight * points
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slopes = (
            1 / np.broadcast_to(towards_low, points.shape),
            1 / np.broadcast_to(towards_high, points.shape),
        )
        for level in levels:
            hit = _between(
                level, nodes, points[:, rays], (slopes[0][:, rays], slopes[1][:, rays]), endless=not weight
            )
            pair, child = np.nonzero(hit)
            rays, nodes = rays[pair], nodes[pair] * level.children + child
    return Visits(rays, nodes, np.zeros(rays.shape))


def _between(
    level: Level, nodes: Integers, points: Floats, slopes: tuple[Floats, Floats], *, endless: bool
) -> Masks:
    first: Floats = np.zeros((nodes.size, level.children))
    last = np.full(first.shape, np.inf if endless else 1.0)
    for axis in range(3):
        point = points[axis][:, None]
        # s * (high - p) >= box.low - p, and s * (low - p) <= box.high - p
        for side, slope, rising in (
            (level.low[axis], slopes[1][axis][:, None], True),
            (level.high[axis], slopes[0][axis][:, None], False),
        ):
            place = (np.take(side, nodes, axis=0) - point) * slope
            begins = (slope > 0) == rising
            np.fmax(first, np.where(begins, place, -np.inf), out=first)
            np.fmin(last, np.where(begins, np.inf, place), out=last)
    return first <= last * (1 + 2 * gamma(3)) + 2 * gamma(3)
