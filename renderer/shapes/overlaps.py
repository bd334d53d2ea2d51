"""Resolves coplanar overlaps and coincident ellipsoids by scene order, not by rounding.

Rays hit such shapes at distances that are equal up to rounding, so that neighbouring pixels would show
different ones. The pairs of primitives are found in advance, and rays that hit the later one look for the
earlier one.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.interaction import Rays, RayStage, first_of_each
from renderer.math.arrays import Floats, Integers, Masks, taken
from renderer.shapes.family import Family


@dataclass(frozen=True, slots=True, eq=False)
class Earlier:
    """Earlier primitives of pairs, of a small family, intersected one by one.

    Attributes
    ----------
    family : Family
    items, later : (P,) int64
        Pairs: numbers within the family, and numbers among all primitives.
    """

    family: Family
    items: Integers
    later: Integers

    def run(self, rays: "Tied") -> None:
        """Offer hits with primitives that come before the one that a ray has hit."""
        hit = np.zeros(rays.ties.later.size, dtype=bool)
        hit[rays.known] = True
        for item in np.unique(self.items[hit[self.later]]).tolist():
            self.family.intersect(item, rays)


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Stage: rays that have hit one of several surfaces in one place are given the first of the scene.

    Attributes
    ----------
    offsets : (shapes of the scene + 1,) int64
        Number of each shape's first primitive among all P; P for a miss, which is last.
    pairs : (M,) int64
        Sorted: P times the later primitive of a pair, plus the earlier one.
    later : (P + 1,) bool
        Primitives that come after another.
    alone : tuple of Earlier
    trees : tuple of RayStage
        Trees of earlier primitives.
    """

    offsets: Integers
    pairs: Integers
    later: Masks
    alone: tuple[Earlier, ...]
    trees: tuple[RayStage, ...]

    def run(self, rays: Rays) -> None:
        """Look for hits with earlier primitives, for rays that hit a later one of a pair."""
        hit = self.offsets[rays.shapes] + rays.primitives
        chosen = np.flatnonzero(self.later[hit])
        if not chosen.size:
            return
        tied = Tied.of(rays, chosen, self)
        for earlier in self.alone:
            earlier.run(tied)
        for tree in self.trees:
            tree.run(tied)
        tied.write(rays, chosen)

    def come_before(self, shapes: Integers, primitives: Integers, known: Integers) -> Masks:
        """Whether primitives (N,) are the earlier ones of pairs with those of the numbers `known` (N,)."""
        wanted = known * (self.later.size - 1) + self.offsets[shapes] + primitives
        found = np.searchsorted(self.pairs, wanted)
        return np.asarray(self.pairs[np.minimum(found, self.pairs.size - 1)] == wanted)


@dataclass(slots=True, eq=False)
class Tied(Rays):
    """Rays that have hit the later one of some pairs: of hits with the earlier ones they take the first.

    `t` stays infinite: roundings put the earlier hit before the later one or behind it.

    Attributes
    ----------
    ties : Overlaps
    known : (N,) int64
        Primitive that each ray has hit, of all.
    distances : (N,) float64
        Of the hits taken so far.
    """

    ties: Overlaps = field(kw_only=True)
    known: Integers = field(kw_only=True)
    distances: Floats = field(kw_only=True)

    @classmethod
    def of(cls, rays: Rays, chosen: Integers, ties: Overlaps) -> "Tied":
        """Some rays of a block, with what they have hit."""
        shapes, primitives = rays.shapes[chosen], rays.primitives[chosen]
        start = rays.origin_surfaces
        tied = cls(
            rays.origins_at(chosen),
            taken(rays.directions, chosen),
            rays.pixels[chosen],
            rays.samples[chosen],
            origin_surfaces=None if start is None else start.part(chosen),
            ties=ties,
            known=ties.offsets[shapes] + primitives,
            distances=rays.t[chosen],
        )
        tied.shapes, tied.primitives = shapes, primitives
        tied.coordinates = taken(rays.coordinates, chosen)
        return tied

    def write(self, rays: Rays, chosen: Integers) -> None:
        """Put the hits back into the block."""
        rays.t[chosen] = self.distances
        rays.shapes[chosen], rays.primitives[chosen] = self.shapes, self.primitives
        rays.coordinates[:, chosen] = self.coordinates

    def offer(
        self,
        candidates: Integers,
        t: Floats,
        coordinates: tuple[Floats, ...],
        shapes: Integers,
        primitives: Integers,
    ) -> None:
        """Take hits that come before the known one and any taken so far, whatever their distance."""
        shapes, primitives = (np.broadcast_to(numbers, t.shape) for numbers in (shapes, primitives))
        shape, primitive = self.shapes[candidates], self.primitives[candidates]
        first = (shapes < shape) | ((shapes == shape) & (primitives < primitive))
        taken_now = first & self.ties.come_before(shapes, primitives, self.known[candidates])
        rays = candidates[taken_now]
        self.distances[rays] = t[taken_now]
        self.shapes[rays], self.primitives[rays] = shapes[taken_now], primitives[taken_now]
        for row, values in zip(self.coordinates, coordinates, strict=False):
            row[rays] = values[taken_now]

    def offer_several(
        self,
        candidates: Integers,
        t: Floats,
        coordinates: tuple[Floats, Floats],
        items: Integers,
        numbers: tuple[Integers, Integers],
    ) -> None:
        """Take the first of a ray's hits that come before the known one."""
        shapes, primitives = (number[items] for number in numbers)
        before = np.flatnonzero(self.ties.come_before(shapes, primitives, self.known[candidates]))
        order = before[np.lexsort((items[before], candidates[before]))]
        best = first_of_each(candidates, order)
        u, v = coordinates
        self.offer(candidates[best], t[best], (u[best], v[best]), shapes[best], primitives[best])
