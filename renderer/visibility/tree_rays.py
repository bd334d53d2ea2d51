"""Shadows of many triangles where many of them may matter to a point: one ray a light point.

A triangle is in a ray's way if it contains the ray by the watertight test and the ray's ends are on different
sides of its plane. Rays stop at the first that is.
"""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import NO_ITEM, Bvh, Visits, turns, visits_of_rays
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, taken
from renderer.shapes import woop
from renderer.shapes.triangles import Triangles
from renderer.visibility.shafts import Traversal
from renderer.visibility.sides import end_sides, rounding_of, start_sides

RAYS_AT_ONCE = 8192
"""Rays that traverse the tree at once."""


@dataclass(frozen=True, slots=True)
class RayShadows:
    """Sends rays from points to all their light points.

    Attributes
    ----------
    family : Triangles
    tree : Bvh
    emitter : Emitter
    """

    family: Triangles
    tree: Bvh
    emitter: Emitter

    def mark(self, view: LightView, positions: Floats, shafts: Visits, levels: int) -> None:
        """Send rays that begin with the nodes of this level that the shafts of their points have hit."""
        owners, nodes = shafts.rays, shafts.nodes
        points, first = np.unique(owners, return_index=True)
        step = max(1, RAYS_AT_ONCE // view.light_points.count)
        ends = np.append(first, owners.size)
        for low in range(0, points.size, step):
            high = min(low + step, points.size)
            part = slice(ends[low], ends[high])
            index = points[low:high]
            own = np.repeat(np.arange(high - low), np.diff(ends[low : high + 1]))
            traversal = Traversal(own, nodes[part], levels)
            hidden = self._hidden(view, positions[:, index], index, traversal)
            if hidden.any():
                view.block(hidden, index)

    def _hidden(self, view: LightView, positions: Floats, index: Integers, traversal: Traversal) -> Masks:
        """Pairs (L, m) with a triangle between, of points at `positions` (3, m)."""
        towards = self._towards(view, positions, index)
        lights, count = towards.shape[1:]
        directions = towards.reshape(3, -1)
        origins = np.tile(positions, lights)
        reach = np.full(lights * count, 1.0 if self.emitter.weight else np.inf)
        # Nothing can stand between a point on the light itself and the light.
        blocked = ~(directions != 0).any(axis=0)
        if view.blocked is not None:
            blocked |= taken(view.blocked, index).reshape(-1)
        before = blocked.copy()
        for begin in traversal.turns(self.tree, positions, towards, reach[0]):
            still = begin.chosen(~blocked[begin.rays])
            visits = visits_of_rays(self.tree.levels[traversal.levels :], origins, directions, reach, still)
            self._block(view, visits, origins, directions, np.tile(index, lights), blocked)
        return (blocked & ~before).reshape(lights, count)

    def _towards(self, view: LightView, positions: Floats, index: Integers) -> Floats:
        """Light points minus points, (3, L, m)."""
        emitter = self.emitter
        u, v = view.light_points.places(index)
        centre = emitter.towards(positions)
        return np.stack([centre[i] + u * emitter.first[i] + v * emitter.second[i] for i in range(3)])

    def _block(
        self,
        view: LightView,
        visits: Visits,
        origins: Floats,
        directions: Floats,
        points: Integers,
        blocked: Masks,
    ) -> None:
        """Visit leaves, one a ray at a time, until the ray is blocked or has none left."""
        order = visits.longest_first()
        rays, leaves = visits.rays[order], visits.nodes[order]
        for turn in turns(rays):
            now = turn[~blocked[rays[turn]]]
            items = self.tree.items[leaves[now]]
            filled = np.flatnonzero(items != NO_ITEM)
            ray, triangle = rays[now][filled // items.shape[1]], items.reshape(-1)[filled]
            blocked[self._stopped(view, origins, directions, points, ray, triangle)] = True

    def _stopped(
        self,
        view: LightView,
        origins: Floats,
        directions: Floats,
        points: Integers,
        rays: Integers,
        triangles: Integers,
    ) -> Integers:
        """Rays of the pairs (ray, triangle) in which the triangle is in the way."""
        rounding = rounding_of(self.family, view, points[rays], triangles)
        vertices = np.take(self.family.vertices, triangles, axis=2, mode="clip")
        inside = woop.inside(vertices, taken(origins, rays), taken(directions, rays), rounding)
        rays, triangles = rays[inside], triangles[inside]
        begins, ways = (taken(vectors, rays) for vectors in (origins, directions))
        start = start_sides(self.family, view, begins, points[rays], triangles)
        end = end_sides(self.family, self.emitter, begins, ways, triangles)
        return rays[start * end < 0]
