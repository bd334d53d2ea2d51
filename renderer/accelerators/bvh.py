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
    """Boxes of the children of all nodes of a level, (3, children, nodes) each."""

    low: Floats
    high: Floats

    @property
    def children(self) -> int:
        """Children a node."""
        return self.low.shape[1]

    def boxes(self, nodes: Integers) -> tuple[Floats, Floats]:
        """The boxes of nodes (P,) of the next level, (3, P) each."""
        parents, places = nodes // self.children, nodes % self.children
        return self.low[:, places, parents], self.high[:, places, parents]

    def below(self, visits: "Visits", met: Masks, entries: Floats | None = None) -> "Visits":
        """Visits of the children that are met, (children, P)."""
        chosen = np.flatnonzero(met)
        child, pair = np.divmod(chosen, visits.rays.size) if visits.rays.size else (chosen, chosen)
        return Visits(
            visits.rays[pair],
            visits.nodes[pair] * self.children + child,
            np.zeros(chosen.size) if entries is None else entries.reshape(-1)[chosen],
        )


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
        levels.append(
            Level(*(np.ascontiguousarray(part.transpose(0, 2, 1)) for part in (grouped_low, grouped_high)))
        )
        low, high = grouped_low.min(axis=2), grouped_high.max(axis=2)
        splits -= fan
        if splits <= 0:
            return tuple(reversed(levels))


@dataclass(frozen=True, slots=True)
class Visits:
    """Nodes that rays may meet, in no order.

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

    def chosen(self, which: Masks) -> "Visits":
        """Some of the visits."""
        index = np.flatnonzero(which)
        return Visits(self.rays[index], self.nodes[index], self.entries[index])


def from_root(rays: Integers) -> Visits:
    """Rays at the root."""
    return Visits(rays, np.zeros_like(rays), np.zeros(rays.size))


def visits_of_rays(
    levels: tuple[Level, ...], origins: Floats, directions: Floats, t: Floats, start: Visits
) -> Visits:
    """Nodes below the given levels that rays (3, N) may meet before t (N,); never leaves out one with a hit.

    Slabs with fmin and fmax, which drop the NaN of a ray in a slab's plane, and a far side moved out by
    twice the rounding of the test (Ize 2013, "Robust BVH ray traversal").
    """
    visits = start
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse, reach = 1 / directions, t * AHEAD
        for level in levels:
            rays = visits.rays
            begin = origins if origins.shape[1] == 1 else np.take(origins, rays, axis=1)
            near, far = _slabs(level, visits.nodes, begin, np.take(inverse, rays, axis=1))
            np.fmin(np.multiply(far, 1 + 2 * gamma(3), out=far), reach[rays], out=far)
            # A box behind the ray has a far side below 0, and no near side is taken to be.
            visits = level.below(visits, np.fmax(near, 0) <= far, near)
    return visits


def _slabs(level: Level, nodes: Integers, origins: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Where rays enter and leave the children's boxes, (children, P) each."""
    near = np.full((level.children, nodes.size), -np.inf)
    far = np.full(near.shape, np.inf)
    first, second, other = (np.empty(near.shape) for _ in range(3))
    for axis in range(3):
        for sides, out in ((level.low, first), (level.high, second)):
            np.take(sides[axis], nodes, axis=1, out=out, mode="clip")
            np.subtract(out, origins[axis], out=out)
            np.multiply(out, inverse[axis], out=out)
        np.fmax(near, np.fmin(first, second, out=other), out=near)
        np.fmin(far, np.fmax(first, second, out=other), out=far)
    return near, far


@dataclass(frozen=True, slots=True)
class Shafts:
    """All segments from each of N points to anywhere on a light.

    Attributes
    ----------
    points : (3, N) float64
    low, high : (3, N) float64
        Bounds of the light minus point, or bounds of the direction to a light at infinity.
    endless : bool
        Whether the light is at infinity.
    normals : (3, N) float64
        What is below the plane through the point with this normal is not in the way.
    slack : (N,) float64
        Below it by more than that.
    """

    points: Floats
    low: Floats
    high: Floats
    endless: bool
    normals: Floats
    slack: Floats


Slopes = tuple[Floats, Floats, Floats]
"""What makes of x in s * reach >= x a least s and a greatest one: two slopes and what to add, (3, N) each."""


def visits_of_shafts(levels: tuple[Level, ...], shafts: Shafts, start: Visits) -> Visits:
    """Nodes below the given levels that may lie between points and a light.

    A place on a segment is p + s (q - p), 0 <= s <= 1: on every axis between p + s (low - p) and
    p + s (high - p). A box is left out if no single s brings these bounds into it on all three axes, or if
    it is below the horizon. For a light at infinity q - p is the direction itself and s has no end.
    """
    visits = start
    rising, falling = _slopes(shafts.high), _slopes(-shafts.low)
    with np.errstate(invalid="ignore", over="ignore"):
        for level in levels:
            visits = level.below(visits, _between(level, visits, shafts, rising, falling))
    return visits


def _slopes(reach: Floats) -> Slopes:
    """Slopes for a reach (3, N).

    Slope 0 gives a least s of 0 where reach is not positive, and no greatest s where it is not negative.
    """
    with np.errstate(divide="ignore"):
        inverse = 1 / reach
    least = np.where(reach > 0, inverse, 0.0)
    greatest = np.where(reach < 0, inverse, 0.0)
    return least, greatest, np.where(reach < 0, 0.0, np.inf)


def _between(level: Level, visits: Visits, shafts: Shafts, rising: Slopes, falling: Slopes) -> Masks:
    rays, shape = visits.rays, (level.children, visits.rays.size)
    first, height = np.zeros(shape), np.zeros(shape)
    last = np.full(shape, np.inf if shafts.endless else 1.0)
    low, high, spare, other = (np.empty(shape) for _ in range(4))
    for axis in range(3):
        point, normal = shafts.points[axis][rays], shafts.normals[axis][rays]
        for sides, out in ((level.low, low), (level.high, high)):
            np.take(sides[axis], visits.nodes, axis=1, out=out, mode="clip")
            np.subtract(out, point, out=out)
        np.multiply(low, normal, out=spare)
        np.maximum(spare, np.multiply(high, normal, out=other), out=spare)
        np.add(height, spare, out=height)
        # s * (light.high - p) >= box.low - p, and s * (p - light.low) >= p - box.high
        np.negative(high, out=high)
        for side, slopes in ((low, rising), (high, falling)):
            least, greatest, beyond = (values[axis][rays] for values in slopes)
            np.fmax(first, np.multiply(side, least, out=spare), out=first)
            np.add(np.multiply(side, greatest, out=spare), beyond, out=spare)
            np.fmin(last, spare, out=last)
    last *= 1 + 2 * gamma(3)
    last += 2 * gamma(3)
    return (first <= last) & (height >= -shafts.slack[rays])
