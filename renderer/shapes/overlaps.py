"""Flat shapes that overlap in one plane: which of them is seen must not depend on a rounding.

Rays hit such shapes at distances that are equal but for rounding, each formed by another formula. The
nearest would be the one in some pixels and the other in their neighbours. So the first of the scene is taken
wherever a ray hits it and one that lies in its plane.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from renderer.interaction import Rays
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.math.numerics import SURFACE
from renderer.shapes.polygons import FlatFamily, Polygons


@dataclass(frozen=True, slots=True, eq=False)
class First:
    """Something flat that comes before others of its plane.

    Attributes
    ----------
    intersect : callable
        Offers rays their hits with it.
    before : (P + 1,) bool
        Which flat primitives of the scene it comes before; the last entry stands for all that is not flat.
    """

    intersect: Callable[[Rays], None]
    before: Masks


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Stage: rays that have hit one of several shapes in one plane are given the first of them.

    Attributes
    ----------
    places : (shapes of the scene + 1,) int64
        Number of each shape's first primitive among the flat ones; P for others, and last for a miss.
    firsts : tuple of First
    """

    places: Integers
    firsts: tuple[First, ...]

    def run(self, rays: Rays) -> None:
        """Ask for hits with what comes first, where something is hit that it comes before."""
        hit = self.places[rays.shapes] + rays.primitives
        for first in self.firsts:
            if not first.before[hit].any():
                continue
            again = rays.anew()
            first.intersect(again)
            taken = np.flatnonzero(np.isfinite(again.t) & first.before[hit])
            rays.t[taken], rays.shapes[taken] = again.t[taken], again.shapes[taken]
            rays.primitives[taken] = again.primitives[taken]
            rays.coordinates[:, taken] = again.coordinates[:, taken]
            hit[taken] = self.places[rays.shapes[taken]] + rays.primitives[taken]


def places_of(families: Sequence[FlatFamily], shapes: int) -> Integers:
    """`Overlaps.places` for the flat families of a scene of so many shapes."""
    count = sum(family.numbers.size for family in families)
    places, begin = np.full(shapes + 1, count, dtype=np.int64), 0
    for family in families:
        numbers, first = np.unique(family.numbers, return_index=True)
        places[numbers] = begin + first
        begin += family.numbers.size
    return places


def overlapping(some: FlatFamily, others: FlatFamily) -> tuple[Integers, Integers]:
    """Pairs (P,) of primitives that lie in one plane and overlap by more than rounding.

    What only shares an edge or a corner does not overlap: some edge of one of the two has all of the other on
    its outside (Gottschalk, Lin and Manocha 1996, in the plane).

    Parameters
    ----------
    some : FlatFamily
        One after another is compared with all others: a few.
    others : FlatFamily
    """
    low, high = (bound(others.corners(), axis=0) for bound in (np.min, np.max))
    found = [_near(some, which, others, low, high) for which in range(some.numbers.size)]
    first = np.arange(some.numbers.size).repeat([near.size for near in found])
    second = np.concatenate(found)
    if not second.size:
        return first, second
    a, b = some.part(first).occluders(), others.part(second).occluders()
    room = SURFACE * (a.sizes + b.sizes)
    together = np.flatnonzero(~(_beside(a, b, room) | _beside(b, a, room)))
    return first[together], second[together]


def _near(some: FlatFamily, which: int, others: FlatFamily, low: Floats, high: Floats) -> Integers:
    """Other primitives whose bounds (3, K) overlap those of one, and that lie in its plane."""
    corners = some.corners()[:, :, which]
    room = SURFACE * (some.sizes[which] + others.sizes)
    begin, end = corners.min(axis=0)[:, None] - room, corners.max(axis=0)[:, None] + room
    near = np.flatnonzero(np.all((low <= end) & (high >= begin), axis=0))
    normal, anchor = some.normals[:, which, None], corners[0][:, None]
    heights = np.stack([dot(normal, corner - anchor) for corner in others.corners()[:, :, near]])
    return near[(np.abs(heights) <= room[near]).all(axis=0)]


def _beside(a: Polygons, b: Polygons, room: Floats) -> Masks:
    """Whether an edge of polygons a (P,) has all corners of b on its outside, or less than `room` inside."""
    beside = np.zeros(room.size, dtype=bool)
    for normals, anchors in zip(a.edge_normals, a.edge_anchors, strict=True):
        depths = np.stack([dot(normals, corner - anchors) for corner in b.corners])
        beside |= depths.max(axis=0) <= room
    return beside
