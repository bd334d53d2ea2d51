"""Pairs of primitives in one place, found through trees of boxes: in one plane, or equal ellipsoids."""

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement

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
    """What offers hits with the earlier ones of pairs."""
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


def _pairs(families: Sequence[Family], begins: Integers) -> Iterator[Found]:
    """Numbers of earlier and of later primitives, of all."""
    yield np.arange(0), np.arange(0)
    # Few boxes are compared with a tree of many.
    by_size = sorted(range(len(families)), key=lambda number: families[number].numbers.size)
    for i, j in combinations_with_replacement(by_size, 2):
        if families[i].surface != families[j].surface:
            continue
        for own, others in coinciding(families[i], families[j]):
            a, b = begins[i] + own, begins[j] + others
            swapped = families[i].numbers[own] > families[j].numbers[others]
            yield np.where(swapped, b, a), np.where(swapped, a, b)


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
    for start in range(0, some.numbers.size, PORTION):
        own = np.arange(start, min(start + PORTION, some.numbers.size))
        owners, items = _met(tree, others.numbers, least[:, own], greatest[:, own], after[own])
        own = own[owners]
        near = (low[:, items] <= greatest[:, own]) & (high[:, items] >= least[:, own])
        found = np.flatnonzero(near.all(axis=0) & (others.numbers[items] > after[own]))
        yield own[found], items[found]


def _boxes(family: Family) -> tuple[Floats, Floats]:
    corners = family.corners()
    return corners.min(axis=0), corners.max(axis=0)


def _met(tree: Bvh, numbers: Integers, low: Floats, high: Floats, after: Integers) -> Found:
    """Boxes (3, N), and items of shapes after `after` (N,) in leaves that overlap them."""
    visits = from_root(np.arange(after.size))
    for level, last in zip(tree.levels, _last_shapes(tree, numbers), strict=True):
        begin, end = taken(low, visits.rays), taken(high, visits.rays)
        near = last[:, visits.nodes] > after[visits.rays]
        for axis in range(3):
            sides = level.sides[axis]
            near &= sides[:, visits.nodes] <= end[axis]
            near &= sides[:, visits.nodes + level.nodes] >= begin[axis]
        visits = level.below(visits, near)
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
