"""A balanced tree of boxes, walked breadth first by many rays at once.

Every level is walked in one go over all (ray, node) pairs, so the number of NumPy calls depends on the depth
alone. Nodes have eight children: fewer levels, and each gather brings eight boxes that lie side by side.
"""

import math
from collections.abc import Iterator
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


def turns(owners: Integers) -> Iterator[Integers]:
    """Places in a sorted list by turns: the first of every owner, the next, then twice as many each time."""
    rank = np.arange(owners.size) - np.searchsorted(owners, owners)
    first, last = 0, 1
    while rank.size and first <= rank.max():
        yield np.flatnonzero((rank >= first) & (rank < last))
        first, last = last, 2 * last


def visits_of_rays(
    levels: tuple[Level, ...], origins: Floats, directions: Floats, t: Floats, start: Visits
) -> Visits:
    """Nodes below the given levels that rays (3, N) may meet before t (N,); never leaves out one with a hit.

    Slabs with a far side moved out by twice the rounding of the test (Ize 2013, "Robust BVH ray traversal").
    A ray in the plane of a box's side misses the box, by a NaN or without: what the box holds ends before.
    """
    visits = start
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse, reach = 1 / directions, t * AHEAD
        for level in levels:
            rays = visits.rays
            begin = origins if origins.shape[1] == 1 else np.take(origins, rays, axis=1)
            near, far = _slabs(level, visits.nodes, begin, np.take(inverse, rays, axis=1))
            np.minimum(np.multiply(far, 1 + 2 * gamma(3), out=far), reach[rays], out=far)
            # A box behind the ray has a far side below 0, and no near side is taken to be.
            visits = level.below(visits, np.maximum(near, 0) <= far, near)
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
        np.maximum(near, np.minimum(first, second, out=other), out=near)
        np.minimum(far, np.maximum(first, second, out=other), out=far)
    return near, far
