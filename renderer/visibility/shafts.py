"""Shafts from points to the whole light, and rays to each light point."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import Bvh, Visits, visits_of
from renderer.accelerators.shafts import Shafts
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks
from renderer.math.numerics import PLANE_ERROR, gamma

ROUNDING_BOUND = 8 * PLANE_ERROR
"""Rounding bound, relative to the sizes: deeper geometry cannot touch a point."""

PAIRS_AT_ONCE = 16384
"""Pairs of ray and node whose boxes are intersected at once: their few temporaries stay in cache."""


def shafts_of(view: LightView, size: float) -> Shafts:
    """Shafts from the points of a view to its light, past shapes of some size.

    What is below the plane of a point's own surface stands in no light that counts: a light point below that
    horizon gives nothing.
    """
    emitter, positions = view.emitter, view.of_points(view.points.positions)
    ends = emitter.ends()
    return Shafts(
        points=positions,
        low=ends.min(axis=1, keepdims=True) - emitter.weight * positions,
        high=ends.max(axis=1, keepdims=True) - emitter.weight * positions,
        endless=not emitter.weight,
        normals=view.of_points(view.points.normals),
        slack=ROUNDING_BOUND * (view.of_points(view.points.sizes) + size),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Traversal:
    """Hits of the shafts of m points: points `owners` (P,), sorted, at `nodes` (P,) after some levels."""

    owners: Integers
    nodes: Integers
    levels: int

    def turns(self, tree: Bvh, positions: Floats, towards: Floats, reach: float) -> Iterator[Visits]:
        """Nodes where the rays to the light points begin: first the one in which each ray is longest.

        An occluder is most likely there. Then all others that the ray hits.

        Parameters
        ----------
        tree : Bvh
        positions : (3, m) float64
        towards : (3, L, m) float64
            Light points minus points; ray number l * m + p goes from point p to light point l.
        reach : float
            Ends of the rays, in units of `towards`.
        """
        lengths = self._lengths(tree, positions, towards, reach)
        starts = np.flatnonzero(np.diff(self.owners, prepend=-1))
        longest = np.take(np.maximum.reduceat(lengths, starts, axis=1), self.owners, axis=1)
        hit = lengths >= 0
        first = hit & (lengths == longest)
        yield self._visits(first, positions.shape[1])
        yield self._visits(hit & ~first, positions.shape[1])

    def _lengths(self, tree: Bvh, positions: Floats, towards: Floats, reach: float) -> Floats:
        """Lengths of rays within the nodes' boxes, (L, P), widened by rounding; negative beside them."""
        sides = tree.levels[self.levels - 1].boxes(self.nodes)
        beside = [[side[axis] - positions[axis][self.owners] for side in sides] for axis in range(3)]
        lights, step = towards.shape[1], max(1, PAIRS_AT_ONCE // self.nodes.size)
        parts = [
            self._lengths_to(towards[:, start : start + step], beside, reach)
            for start in range(0, lights, step)
        ]
        return np.concatenate(parts)

    def _lengths_to(self, towards: Floats, beside: list[list[Floats]], reach: float) -> Floats:
        shape = (towards.shape[1], self.nodes.size)
        begins, ends = np.zeros(shape), np.full(shape, reach)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for axis in range(3):
                inverse = np.take(1 / towards[axis], self.owners, axis=1)
                low, high = beside[axis]
                enter, leave = low * inverse, np.multiply(high, inverse, out=inverse)
                np.maximum(begins, np.minimum(enter, leave), out=begins)
                np.minimum(ends, np.maximum(enter, leave, out=enter), out=ends)
            return ends * (1 + 2 * gamma(3)) - begins

    def _visits(self, chosen: Masks, count: int) -> Visits:
        index = np.flatnonzero(chosen)
        light = index // self.owners.size
        pair = index - light * self.owners.size
        return visits_of(light * count + self.owners[pair], self.nodes[pair])
