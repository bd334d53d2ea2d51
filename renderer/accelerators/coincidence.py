"""Pairs of primitives in one place, found through trees of boxes: in one plane, or equal ellipsoids."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Self

import numpy as np

from renderer.accelerators import bvh
from renderer.accelerators.bvh import NOTHING, Bvh, from_root
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.trees import in_tree, tree_of
from renderer.interaction import RayStage
from renderer.math.arrays import Floats, Integers, taken
from renderer.math.numerics import SURFACE
from renderer.shapes.family import Family
from renderer.shapes.overlaps import Earlier, Overlaps

PORTION = 1 << 14
"""Primitives whose boxes are compared with a tree together, and pairs that are tested together."""

VISITS = 1 << 20
"""Most visits of boxes at once, 50 MB: where more overlap, primitives go in smaller portions."""

MOST_VISITS = 1 << 24
"""Visits after which no more pairs of two families are looked for, some two seconds. Only where thousands of
primitives overlap that are not equal are there as many; the other ties are left to rounding."""

Found = tuple[Integers, Integers]
"""Pairs (P,) of primitives of two families."""


def overlaps_of(families: Sequence[Family], shapes: int) -> Overlaps | None:
    """The stage that breaks ties between shapes of a scene of so many; None where there are none."""
    begins = np.cumsum([0, *(family.numbers.size for family in families)])
    earlier, later = (np.concatenate(part) for part in zip(*_pairs(families, begins), strict=True))
    if not earlier.size:
        return None
    alone, trees = _sources(families, begins, earlier, later)
    marks = np.zeros(begins[-1] + 1, dtype=bool)
    marks[later] = True
    pairs = np.sort(later * begins[-1] + earlier)
    return Overlaps(_places(families, begins, shapes), pairs, marks, tuple(alone), tuple(trees))


def _places(families: Sequence[Family], begins: Integers, shapes: int) -> Integers:
    places = np.full(shapes + 1, begins[-1], dtype=np.int64)
    for begin, family in zip(begins, families, strict=False):
        numbers, first = np.unique(family.numbers, return_index=True)
        places[numbers] = begin + first
    return places


def _sources(
    families: Sequence[Family], begins: Integers, earlier: Integers, later: Integers
) -> tuple[list[Earlier], list[RayStage]]:
    """Sources of hits with the earlier primitives of pairs."""
    alone: list[Earlier] = []
    trees: list[RayStage] = []
    for begin, end, family in zip(begins, begins[1:], families, strict=False):
        chosen = np.flatnonzero((earlier >= begin) & (earlier < end))
        items, which = np.unique(earlier[chosen] - begin, return_inverse=True)
        part = family.part(items)
        if in_tree(part):
            trees.append(TreeIntersector(part, tree_of(part)))
        elif items.size:
            alone.append(Earlier(part, which.reshape(-1), later[chosen]))
    return alone, trees


@dataclass(frozen=True, slots=True, eq=False)
class _Distinct:
    """A family with the first of equal primitives alone: of n copies of a mesh there are n pairs, not n^2.

    Attributes
    ----------
    begin : int
        Number of the family's first primitive among those of all families.
    numbers : (N,) int64
        Shapes of all its primitives.
    part : Family
        The K distinct primitives.
    items : (K,) int64
        Which of the family's they are.
    groups : (N,) int64
        For each of the family's, the distinct one that it equals.
    order, ends : (N,) and (K + 1,) int64
        The family's primitives by group, and where each group ends in them.
    """

    begin: int
    numbers: Integers
    part: Family
    items: Integers
    groups: Integers
    order: Integers
    ends: Integers

    @classmethod
    def of(cls, family: Family, begin: int) -> Self:
        items, groups = _equal(family)
        part = family if items.size == groups.size else family.part(items)
        ends = np.cumsum(np.concatenate([[0], np.bincount(groups, minlength=items.size)]))
        return cls(begin, family.numbers, part, items, groups, np.argsort(groups, kind="stable"), ends)

    def copies(self) -> Found:
        """The first ones, and equal ones of later shapes."""
        first = self.items[self.groups]
        later = np.flatnonzero(self.numbers != self.numbers[first])
        return self.begin + first[later], self.begin + later

    def before(self, own: Integers, other: "_Distinct", others: Integers) -> Found:
        """Distinct primitives (P,), and those equal to others (P,) that are of later shapes."""
        counts = np.diff(other.ends)[others]
        pairs = np.arange(own.size).repeat(counts)
        within = np.arange(pairs.size) - (np.cumsum(counts) - counts).repeat(counts)
        first, copies = self.items[own[pairs]], other.order[other.ends[others[pairs]] + within]
        later = other.numbers[copies] > self.numbers[first]
        return self.begin + first[later], other.begin + copies[later]


def _equal(family: Family) -> Found:
    """The first of each group of equal primitives (K,), and the group of each primitive (N,)."""
    bits = family.corners().reshape(-1, family.numbers.size).astype(np.float64).view(np.uint64)
    weights = np.random.default_rng(0).integers(1, 1 << 63, (len(bits), 1), dtype=np.uint64)
    _, first, groups = np.unique((bits * weights).sum(axis=0), return_index=True, return_inverse=True)
    order = np.argsort(first)
    items, groups = first[order], np.argsort(order)[groups.reshape(-1)]
    copies = np.flatnonzero(items[groups] != np.arange(groups.size))
    portions = (copies[start : start + PORTION] for start in range(0, copies.size, PORTION))
    if all(family.coincide(part, family, items[groups[part]]).all() for part in portions):
        return items, groups
    # Other primitives in the same box: none are taken for equal.
    return np.arange(groups.size), np.arange(groups.size)


def _pairs(families: Sequence[Family], begins: Integers) -> Iterator[Found]:
    """Numbers of earlier and of later primitives, of all."""
    yield np.arange(0), np.arange(0)
    distinct = [_Distinct.of(*each) for each in zip(families, begins[:-1].tolist(), strict=True)]
    yield from (each.copies() for each in distinct)
    # Few boxes are compared with a tree of many.
    distinct.sort(key=lambda each: each.items.size)
    for some, rest in combinations_with_replacement(distinct, 2):
        if some.part.surface == rest.part.surface:
            for own, others in coinciding(some.part, rest.part):
                yield some.before(own, rest, others)
                yield rest.before(others, some, own)


def coinciding(some: Family, others: Family) -> Iterator[Found]:
    """Pairs of primitives of different shapes whose surfaces share an area, each once."""
    for own, near in _near(some, others):
        for start in range(0, own.size, PORTION):
            part = slice(start, start + PORTION)
            together = some.coincide(own[part], others, near[part])
            yield own[part][together], near[part][together]


def _near(some: Family, others: Family) -> Iterator[Found]:
    """Pairs of different shapes whose boxes overlap, give or take what rounding may move them."""
    low, high = _boxes(others)
    tree = tree_of(others) if in_tree(others) else bvh.build(low, high)
    least, greatest = _boxes(some)
    room = SURFACE * (2 * some.sizes + others.reaches().max())
    least, greatest = least - room, greatest + room
    # Within a family each pair is met once: by the one that is earlier in the scene.
    after = some.numbers if some is others else np.full(some.numbers.size, -1)
    starts = np.arange(0, some.numbers.size, PORTION)
    waiting = [np.arange(start, min(start + PORTION, some.numbers.size)) for start in starts[::-1]]
    spent = 0
    while waiting and spent < MOST_VISITS:
        own = waiting.pop()
        met = _met(tree, others.numbers, least[:, own], greatest[:, own], after[own])
        if met is None:
            waiting += [own[own.size // 2 :], own[: own.size // 2]]
            spent += VISITS
            continue
        owners, items = met
        spent += owners.size
        own = own[owners]
        near = (low[:, items] <= greatest[:, own]) & (high[:, items] >= least[:, own])
        found = np.flatnonzero(near.all(axis=0) & (others.numbers[items] > after[own]))
        yield own[found], items[found]


def _boxes(family: Family) -> tuple[Floats, Floats]:
    corners = family.corners()
    return corners.min(axis=0), corners.max(axis=0)


def _met(tree: Bvh, numbers: Integers, low: Floats, high: Floats, after: Integers) -> Found | None:
    """Boxes (3, N), and items of shapes after `after` (N,) in leaves that overlap them.

    None where several boxes take too many visits together.
    """
    visits = from_root(np.arange(after.size))
    for level, last in zip(tree.levels, _last_shapes(tree, numbers), strict=True):
        begin, end = taken(low, visits.rays), taken(high, visits.rays)
        near = last[:, visits.nodes] > after[visits.rays]
        for axis in range(3):
            sides = level.sides[axis]
            near &= sides[:, visits.nodes] <= end[axis]
            near &= sides[:, visits.nodes + level.nodes] >= begin[axis]
        visits = level.below(visits, near)
        if visits.rays.size > VISITS and after.size > 1:
            return None
    items = tree.items[visits.nodes]
    filled = np.flatnonzero(items != NOTHING)
    return visits.rays[filled // items.shape[1]], items.reshape(-1)[filled]


def _last_shapes(tree: Bvh, numbers: Integers) -> list[Integers]:
    """The last shape below each child of each node, (children, nodes), for each level."""
    last = np.where(tree.items == NOTHING, -1, numbers[tree.items]).max(axis=1)
    levels = []
    for level in reversed(tree.levels):
        levels.append(last.reshape(level.nodes, level.children).T)
        last = levels[-1].max(axis=0)
    return levels[::-1]
