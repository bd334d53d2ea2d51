"""Pairs of primitives in one place, found through trees of boxes: in one plane, or equal ellipsoids."""

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement

import numpy as np

from renderer.accelerators import bvh
from renderer.accelerators.bvh import NO_ITEM, Bvh, from_root
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.trees import in_tree, tree_of
from renderer.interaction import RayStage
from renderer.math.arrays import Floats, Integers, taken, unit
from renderer.math.numerics import PLANE_ERROR
from renderer.shapes.family import Family
from renderer.shapes.overlaps import Earlier, Overlaps

PRIMITIVES_AT_ONCE = 1 << 14
"""Primitives compared with a tree at once, and pairs tested at once."""

MAX_VISITS = 1 << 20
"""Box visits at once, 50 MB; where more boxes overlap, the portions of primitives are smaller."""

MOST_VISITS = 1 << 24
"""Most visits in the search for pairs of two families, some two seconds. Only thousands of overlapping,
unequal primitives need more; their further ties are left to rounding."""

Found = tuple[Integers, Integers]
"""Pairs (P,) of primitives of two families."""


def overlaps_of(families: Sequence[Family], shapes: int) -> Overlaps | None:
    """The stage that breaks ties between shapes of a scene of so many; None if there are none."""
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
    offsets = np.full(shapes + 1, begins[-1], dtype=np.int64)
    for begin, family in zip(begins, families, strict=False):
        numbers, first = np.unique(family.numbers, return_index=True)
        offsets[numbers] = begin + first
    return offsets


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


def _distinct(family: Family) -> Integers:
    """The first of each group of equal primitives of a family, (K,).

    Rays hit equal ones at bitwise equal distances, and the first counts, so they need no pairs; n copies of a
    mesh would have n^2.
    """
    bits = family.corners().reshape(-1, family.numbers.size).astype(np.float64).view(np.uint64)
    weights = np.random.default_rng(0).integers(1, 1 << 63, (len(bits), 1), dtype=np.uint64)
    _, first, groups = np.unique((bits * weights).sum(axis=0), return_index=True, return_inverse=True)
    owners = first[groups.reshape(-1)]
    copies = np.flatnonzero(owners != np.arange(owners.size))
    portions = (
        copies[start : start + PRIMITIVES_AT_ONCE] for start in range(0, copies.size, PRIMITIVES_AT_ONCE)
    )
    if all(family.coincide(part, family, owners[part]).all() for part in portions):
        return np.sort(first)
    # Other primitives in the same box: none are taken for equal.
    return np.arange(owners.size)


def _candidates(families: Sequence[Family]) -> list[Integers]:
    """Primitives of each family that may have pairs."""
    candidates = [_distinct(family) for family in families]
    for surface in {family.surface for family in families}:
        alike = [i for i, family in enumerate(families) if family.surface == surface]
        found = _in_company([families[i] for i in alike], [candidates[i] for i in alike])
        for i, items in zip(alike, found, strict=True):
            candidates[i] = items
    return candidates


def _in_company(families: Sequence[Family], candidates: Sequence[Integers]) -> list[Integers]:
    """Primitives of families of one surface that may coincide with another of them.

    In most scenes these are few, although many boxes overlap.
    """
    found = zip(_signatures(families), candidates, strict=True)
    values, rooms = np.hstack([signatures[:, items] for signatures, items in found])
    order = np.argsort(values - rooms)
    least, greatest = (values - rooms)[order], np.maximum.accumulate((values + rooms)[order])
    near = np.append(False, least[1:] <= greatest[:-1])
    kept = np.empty_like(near)
    kept[order] = near | np.append(near[1:], False)
    parts = np.split(kept, np.cumsum([items.size for items in candidates])[:-1])
    return [items[part] for items, part in zip(candidates, parts, strict=True)]


def _signatures(families: Sequence[Family]) -> list[Floats]:
    """Numbers and rooms (2, K) of each family, by any place between the shapes and any direction."""
    random = np.random.default_rng(0)
    low, high = (np.hstack(part) for part in zip(*map(_boxes, families), strict=True))
    low, high = low.min(axis=1, keepdims=True), high.max(axis=1, keepdims=True)
    origin = low + random.uniform(0.3, 0.7, (3, 1)) * (high - low)
    direction = unit(random.normal(size=(3, 1)))
    reach = max(family.reaches().max() for family in families)
    return [np.stack(family.signatures(origin, direction, reach)) for family in families]


def _pairs(families: Sequence[Family], begins: Integers) -> Iterator[Found]:
    """Numbers of earlier and of later primitives, of all."""
    yield np.arange(0), np.arange(0)
    distinct = _candidates(families)
    parts = [family.part(items) for family, items in zip(families, distinct, strict=True)]
    # Few boxes are compared with a tree of many.
    by_size = sorted(range(len(families)), key=lambda number: distinct[number].size)
    for i, j in combinations_with_replacement(by_size, 2):
        if parts[i].surface != parts[j].surface or not distinct[i].size:
            continue
        for own, others in coinciding(parts[i], parts[j]):
            a, b = begins[i] + distinct[i][own], begins[j] + distinct[j][others]
            swapped = parts[i].numbers[own] > parts[j].numbers[others]
            yield np.where(swapped, b, a), np.where(swapped, a, b)


def coinciding(some: Family, others: Family) -> Iterator[Found]:
    """Pairs of primitives of different shapes whose surfaces share an area, each once."""
    for own, near in _near(some, others):
        for start in range(0, own.size, PRIMITIVES_AT_ONCE):
            part = slice(start, start + PRIMITIVES_AT_ONCE)
            together = some.coincide(own[part], others, near[part])
            yield own[part][together], near[part][together]


def _near(some: Family, others: Family) -> Iterator[Found]:
    """Pairs of different shapes whose boxes overlap up to rounding."""
    low, high = _boxes(others)
    tree = tree_of(others) if in_tree(others) else bvh.build(low, high)
    least, greatest = _boxes(some)
    room = PLANE_ERROR * (2 * some.sizes + others.reaches().max())
    least, greatest = least - room, greatest + room
    # Within a family each pair is found once: from its earlier shape in the scene.
    after = some.numbers if some is others else np.full(some.numbers.size, -1)
    starts = np.arange(0, some.numbers.size, PRIMITIVES_AT_ONCE)
    waiting = [np.arange(start, min(start + PRIMITIVES_AT_ONCE, some.numbers.size)) for start in starts[::-1]]
    spent = 0
    while waiting and spent < MOST_VISITS:
        own = waiting.pop()
        met = _met(tree, others.numbers, least[:, own], greatest[:, own], after[own])
        if met is None:
            waiting += [own[own.size // 2 :], own[: own.size // 2]]
            spent += MAX_VISITS
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

    None if several boxes take too many visits together.
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
        if visits.rays.size > MAX_VISITS and after.size > 1:
            return None
    items = tree.items[visits.nodes]
    filled = np.flatnonzero(items != NO_ITEM)
    return visits.rays[filled // items.shape[1]], items.reshape(-1)[filled]


def _last_shapes(tree: Bvh, numbers: Integers) -> list[Integers]:
    """The last shape below each child of each node, (children, nodes), for each level."""
    last = np.where(tree.items == NO_ITEM, -1, numbers[tree.items]).max(axis=1)
    levels = []
    for level in reversed(tree.levels):
        levels.append(last.reshape(level.nodes, level.children).T)
        last = levels[-1].max(axis=0)
    return levels[::-1]
