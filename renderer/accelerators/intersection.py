"""Nearest hits of rays with many triangles."""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import (
    BOX_DISTANCE_BOUND,
    NO_ITEM,
    Bvh,
    Level,
    Visits,
    from_root,
    turns,
    visits_of_rays,
)
from renderer.interaction import Rays
from renderer.math.arrays import Integers, taken
from renderer.shapes import woop
from renderer.shapes.triangles import Triangles

RAYS_AT_ONCE = 4096
"""Rays that traverse the tree at once: their boxes and triangles stay in cache."""

SHARED_LEVELS = 2
"""Levels that rays traverse breadth first; below, each follows its nearest node, where most rays end."""


@dataclass(frozen=True, slots=True)
class TreeIntersector:
    """Stage: the nearest hits of a block of rays with triangles in a tree.

    Attributes
    ----------
    family : Triangles
    tree : Bvh
        Over the triangles of the family.
    """

    family: Triangles
    tree: Bvh

    def run(self, rays: Rays) -> None:
        """Offer hits, nearest nodes and leaves first, so that those behind them are left out.

        Nodes that begin at the distance of a hit are still visited: of equal hits, the first triangle counts.
        """
        levels = self.tree.levels
        for start in range(0, rays.t.size, RAYS_AT_ONCE):
            chosen = np.arange(start, min(start + RAYS_AT_ONCE, rays.t.size))
            visits = self._traverse(rays, chosen, levels[:SHARED_LEVELS], from_root(np.arange(chosen.size)))
            nearest = visits.nearest()
            for now in (nearest, ~nearest):
                ahead = now & (visits.entries <= rays.t[chosen[visits.rays]] * BOX_DISTANCE_BOUND)
                leaves = self._traverse(rays, chosen, levels[SHARED_LEVELS:], visits.chosen(ahead))
                self._intersect_leaves(rays, chosen, leaves)

    def _traverse(self, rays: Rays, chosen: Integers, levels: tuple[Level, ...], start: Visits) -> Visits:
        directions = taken(rays.directions, chosen)
        return visits_of_rays(levels, rays.origins_at(chosen), directions, rays.t[chosen], start)

    def _intersect_leaves(self, rays: Rays, chosen: Integers, visits: Visits) -> None:
        order = visits.nearest_first()
        owners, leaves, entries = visits.rays[order], visits.nodes[order], visits.entries[order]
        for turn in turns(owners):
            now = turn[entries[turn] <= rays.t[chosen[owners[turn]]] * BOX_DISTANCE_BOUND]
            self._intersect_items(rays, chosen[owners[now]], self.tree.items[leaves[now]])

    def _intersect_items(self, rays: Rays, owners: Integers, items: Integers) -> None:
        filled = np.flatnonzero(items != NO_ITEM)
        offer_hits(self.family, rays, owners[filled // items.shape[1]], items.reshape(-1)[filled])


def offer_hits(family: Triangles, rays: Rays, owners: Integers, triangles: Integers) -> None:
    """Intersect pairs of ray and triangle, (P,) each, and offer the rays their nearest hits."""
    start = None
    if rays.origin_surfaces is not None:
        start = woop.start_of(
            rays.origin_surfaces,
            owners,
            family.numbers[triangles],
            family.primitives[triangles],
            family.sizes[triangles],
        )
    vertices = np.take(family.vertices, triangles, axis=2, mode="clip")
    directions = taken(rays.directions, owners)
    found = woop.hits(vertices, rays.origins_at(owners), directions, start)
    numbers = family.numbers, family.primitives
    rays.offer_several(owners[found.pairs], found.t, (found.u, found.v), triangles[found.pairs], numbers)
