"""Nearest hits of rays with many triangles."""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import AHEAD, NOTHING, Bvh, Visits, from_root, turns, visits_of_rays
from renderer.arrays import Integers, Masks
from renderer.interaction import Rays
from renderer.shapes import woop
from renderer.shapes.triangles import Triangles

PORTION = 2048
"""Rays that walk the tree together: their boxes and triangles stay in cache."""


@dataclass(frozen=True, slots=True)
class TreeMeeting:
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
        """Offer hits, nearest leaves first, so that leaves behind them are left out.

        Leaves at the distance of a hit are not: of equal hits the first triangle counts.
        """
        for start in range(0, rays.t.size, PORTION):
            chosen = np.arange(start, min(start + PORTION, rays.t.size))
            visits = visits_of_rays(
                self.tree.levels,
                rays.origins_at(chosen),
                rays.directions[:, chosen],
                rays.t[chosen],
                from_root(np.arange(chosen.size)),
            )
            if visits.rays.size:
                self._meet_leaves(rays, chosen, visits)

    def _meet_leaves(self, rays: Rays, chosen: Integers, visits: Visits) -> None:
        order = np.lexsort((visits.entries, visits.rays))
        owners, leaves, entries = visits.rays[order], visits.nodes[order], visits.entries[order]
        for turn in turns(owners):
            now = turn[entries[turn] <= rays.t[chosen[owners[turn]]] * AHEAD]
            self._meet_items(rays, chosen[owners[now]], self.tree.items[leaves[now]])

    def _meet_items(self, rays: Rays, owners: Integers, items: Integers) -> None:
        filled: Masks = items != NOTHING
        triangles = items[filled]
        owners = np.broadcast_to(owners[:, None], items.shape)[filled]
        family, start = self.family, None
        if rays.departure is not None:
            start = woop.start_of(
                rays.departure,
                owners,
                family.numbers[triangles],
                family.primitives[triangles],
                family.sizes[triangles],
            )
        found = woop.hits(
            family.vertices[:, :, triangles], rays.origins_at(owners), rays.directions[:, owners], start
        )
        ray, triangle = owners[found.pairs], triangles[found.pairs]
        # Of the hits of one ray the nearest, and of equal ones the first triangle, comes first.
        order = np.lexsort((triangle, found.t, ray))
        best = order[np.flatnonzero(np.diff(ray[order], prepend=-1))]
        triangle = triangle[best]
        rays.offer(
            ray[best],
            found.t[best],
            (found.u[best], found.v[best]),
            family.numbers[triangle],
            family.primitives[triangle],
        )
