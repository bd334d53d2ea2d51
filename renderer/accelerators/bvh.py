"""A balanced tree of boxes, traversed breadth first by many rays at once.

Every level is traversed in one step over all (ray, node) pairs, so the number of NumPy calls depends only on
the depth. Nodes have eight children, for fewer levels, and so that each gather reads eight adjacent boxes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks
from renderer.math.numerics import gamma

LEAF_ITEMS = 4
"""Items in a leaf, at most."""

SPLITS_PER_LEVEL = 3
"""Binary splits a level: 2**3 children a node."""

BOX_WIDENING = gamma(16)
"""Boxes are widened on each side by this share of their longest side."""

BOX_DISTANCE_BOUND = 1 + gamma(32)
"""Bound on how far a hit may lie in front of its box, relative to its distance."""

SAMPLED_ITEMS = 64
"""Items of a node that are sampled to find its longest side: reading a million would take as long as the
rest."""

NO_ITEM = -1
"""Item number of an empty place in a leaf."""


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """Boxes of the children of all nodes of a level.

    Attributes
    ----------
    sides : (3, children, 2 * nodes) float64
        Lower sides of the boxes, then upper ones: the side that a ray reaches first is one index away.
    """

    sides: Floats

    @classmethod
    def of(cls, low: Floats, high: Floats) -> "Level":
        """Form the level from boxes (3, children, nodes)."""
        return cls(np.ascontiguousarray(np.concatenate((low, high), axis=2)))

    @property
    def children(self) -> int:
        """Children a node."""
        return self.sides.shape[1]

    @property
    def nodes(self) -> int:
        """Nodes of the level."""
        return self.sides.shape[2] // 2

    def boxes(self, nodes: Integers) -> tuple[Floats, Floats]:
        """The boxes of nodes (P,) of the next level, (3, P) each."""
        parents = nodes // self.children
        numbers = nodes - parents * self.children
        return self.sides[:, numbers, parents], self.sides[:, numbers, parents + self.nodes]

    def below(self, visits: "Visits", hit: Masks, ways: tuple[Floats, Floats] | None = None) -> "Visits":
        """Visits of the children that are hit, (children, P), in the order of the visits.

        `ways` are the distances at which rays enter and leave the children's boxes, if known.
        """
        chosen = np.flatnonzero(hit.T)
        pair = chosen // self.children
        child = chosen - pair * self.children
        rays, nodes = visits.rays[pair], visits.nodes[pair] * self.children + child
        if ways is None:
            return visits_of(rays, nodes)
        place = child * visits.rays.size + pair
        return Visits(rays, nodes, *(np.take(way.reshape(-1), place) for way in ways))


@dataclass(frozen=True, slots=True, eq=False)
class Bvh:
    """The tree.

    Attributes
    ----------
    levels : tuple of Level
        From the root down; child c of node n is node n * children + c of the next level, in the end a leaf.
    items : (leaves, m) int64
        Item numbers, `NO_ITEM` in empty places.
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
    slack = BOX_WIDENING * (high - low).max(axis=0)
    low, high = np.nextafter(low - slack, -np.inf), np.nextafter(high + slack, np.inf)
    splits = max(0, math.ceil(math.log2(max(1, count) / LEAF_ITEMS)))
    width = -(-count // (1 << splits))
    order = _sorted_by_medians((low + high) / 2, splits, width)
    items = order.reshape(1 << splits, width)
    # A row for each place in the leaves: NumPy reduces across rows much faster than along short ones.
    held = np.ascontiguousarray(items.T)
    empty = held == NO_ITEM
    leaf_low = np.where(empty, np.inf, low[:, held]).min(axis=1)
    leaf_high = np.where(empty, -np.inf, high[:, held]).max(axis=1)
    return Bvh(_levels(leaf_low, leaf_high, splits), items)


def _sorted_by_medians(centers: Floats, splits: int, width: int) -> Integers:
    count = centers.shape[1]
    order = np.full(width << splits, NO_ITEM, dtype=np.int64)
    order[:count] = np.arange(count)
    padded = np.concatenate((centers, np.full((3, 1), np.inf)), axis=1)
    for level in range(splits):
        rows = order.reshape(1 << level, -1)
        axis = _longest_sides(padded, rows)
        keys = np.take(padded.reshape(-1), rows + (axis * padded.shape[1])[:, None], mode="wrap")
        # Empty slots go to both halves in turns, so that no leaf has nothing else.
        empty = rows == NO_ITEM
        keys[empty] = np.where(np.cumsum(empty, axis=1) % 2, np.inf, -np.inf)[empty]
        half = np.argpartition(keys, rows.shape[1] // 2 - 1, axis=1)
        order = np.take_along_axis(rows, half, axis=1).reshape(-1)
    return order


def _longest_sides(centers: Floats, rows: Integers) -> Integers:
    """Axis along which the items of each row (R, m) are farthest apart, by up to `SAMPLED_ITEMS` of them."""
    midpoints = np.take(
        centers, np.ascontiguousarray(rows[:, :: max(1, rows.shape[1] // SAMPLED_ITEMS)].T), axis=1
    )
    known = np.isfinite(midpoints)
    greatest, least = (
        np.where(known, midpoints, -np.inf).max(axis=1),
        np.where(known, midpoints, np.inf).min(axis=1),
    )
    return np.argmax(greatest - least, axis=0)


def _levels(low: Floats, high: Floats, splits: int) -> tuple[Level, ...]:
    """Boxes of all levels from those of the leaves; the root has the remaining splits."""
    levels: list[Level] = []
    while True:
        fan = min(SPLITS_PER_LEVEL, splits)
        low, high = (
            np.ascontiguousarray(part.reshape(3, -1, 1 << fan).transpose(0, 2, 1)) for part in (low, high)
        )
        levels.append(Level.of(low, high))
        low, high = low.min(axis=1), high.max(axis=1)
        splits -= fan
        if splits <= 0:
            return tuple(reversed(levels))


@dataclass(frozen=True, slots=True, eq=False)
class Visits:
    """Nodes that rays may hit, in no order.

    Attributes
    ----------
    rays, nodes : (P,) int64
        Nodes of a level, in the end leaves.
    entries, exits : (P,) float64
        Distances at which the ray enters and leaves the node's box; 0 where these are not needed.
    """

    rays: Integers
    nodes: Integers
    entries: Floats
    exits: Floats

    def chosen(self, which: Masks) -> "Visits":
        """Some of the visits."""
        index = np.flatnonzero(which)
        return Visits(self.rays[index], self.nodes[index], self.entries[index], self.exits[index])

    def nearest_first(self) -> Integers:
        """Order of the visits, sorted by ray, in which each ray continues from one to the next."""
        return self._by_ray(self.entries)

    def longest_first(self) -> Integers:
        """Order of the visits, sorted by ray, with the longest paths through boxes first."""
        with np.errstate(invalid="ignore"):
            lengths = self.exits - self.entries
            return self._by_ray(lengths.max(initial=0.0) - lengths)

    def _by_ray(self, values: Floats) -> Integers:
        """By ray, then by values: those closer than a rounding of the sum count as equal.

        One sort of a sum is much faster than one of two keys. NaN counts as the largest value.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.fmin(values / values.max(initial=0.0), 1.0)
        return np.argsort(self.rays + shares / 2, kind="stable")

    def nearest(self) -> Masks:
        """The earliest visit of each ray, by which they are sorted."""
        if not self.rays.size:
            return np.zeros(0, dtype=bool)
        starts = np.flatnonzero(np.diff(self.rays, prepend=-1))
        least = np.minimum.reduceat(self.entries, starts)
        return self.entries == least.repeat(np.diff(starts, append=self.rays.size))


def visits_of(rays: Integers, nodes: Integers) -> Visits:
    """Visits whose entry and exit distances are not needed."""
    unknown = np.zeros(rays.size)
    return Visits(rays, nodes, unknown, unknown)


def from_root(rays: Integers) -> Visits:
    """Rays at the root."""
    return visits_of(rays, np.zeros_like(rays))


def turns(owners: Integers) -> Iterator[Integers]:
    """Portions of a sorted list: one item of every owner, one more, then twice as many each time."""
    rank = np.arange(owners.size) - np.searchsorted(owners, owners)
    first, last = 0, 1
    while rank.size and first <= rank.max():
        yield np.flatnonzero((rank >= first) & (rank < last))
        first, last = last, 2 * last


def visits_of_rays(
    levels: tuple[Level, ...], origins: Floats, directions: Floats, t: Floats, start: Visits
) -> Visits:
    """Nodes below the given levels that rays (3, N) may hit before t (N,); never leaves out one with a hit.

    Slabs with a far side moved out by twice the rounding of the test (Ize 2013, "Robust BVH ray traversal").
    A ray in the plane of a box's side misses the box, since its items end before that plane.
    """
    visits = start
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse, reach = 1 / directions, t * BOX_DISTANCE_BOUND
        for level in levels:
            rays = visits.rays
            begin = origins if origins.shape[1] == 1 else np.take(origins, rays, axis=1)
            near, far = _slabs(level, visits.nodes, begin, np.take(inverse, rays, axis=1))
            np.minimum(np.multiply(far, 1 + 2 * gamma(3), out=far), reach[rays], out=far)
            # A box behind the ray has a far side below 0; near sides are clamped to 0.
            visits = level.below(visits, near <= far, (near, far))
    return visits


def _slabs(level: Level, nodes: Integers, origins: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Distances at which rays enter and leave the children's boxes, (children, P) each, at least 0."""
    shape = (level.children, nodes.size)
    near, far, distances = np.zeros(shape), np.full(shape, np.inf), np.empty(shape)
    for axis in range(3):
        down = np.signbit(inverse[axis])
        for upper, nearest, out in ((down, np.maximum, near), (~down, np.minimum, far)):
            np.take(level.sides[axis], nodes + upper * level.nodes, axis=1, out=distances, mode="clip")
            np.subtract(distances, origins[axis], out=distances)
            np.multiply(distances, inverse[axis], out=distances)
            nearest(out, distances, out=out)
    return near, far
