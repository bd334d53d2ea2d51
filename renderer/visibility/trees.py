"""Shadows of many triangles.

Points walk the upper levels of the tree with the shaft to the whole light, which rules most of them out. From
the others one ray for each light point goes on, in float64, until anything is in its way. A triangle is in the
way if it contains the ray by the watertight test and the signed distances of both ends from its plane differ in
sign: no length to step over.
"""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import NOTHING, Bvh, Visits, visits_of_rays, visits_of_shafts
from renderer.arrays import Floats, Integers, Masks, dot
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.numerics import SURFACE, snapped
from renderer.shapes import woop
from renderer.shapes.triangles import Triangles

POINTS = 4096
"""Points that walk the upper levels together."""

RAYS = 8192
"""Rays that walk the lower levels together."""

SHAFT_LEVELS = 3
"""Levels that points walk before their rays do; further down a shaft meets more boxes than its rays."""


@dataclass(slots=True)
class TreeShadows:
    """Shadow stage: triangles in a tree between points and one light.

    Attributes
    ----------
    family : Triangles
    tree : Bvh
    emitter : Emitter
    """

    family: Triangles
    tree: Bvh
    emitter: Emitter

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        positions = view.of_points(view.points.positions)
        ends = self.emitter.ends()
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        upper = self.tree.levels[:SHAFT_LEVELS]
        for start in range(0, view.count, POINTS):
            shafts = visits_of_shafts(upper, positions[:, start : start + POINTS], low, high, self.emitter.weight)
            self._send_rays(view, positions, shafts, start)

    def _send_rays(self, view: LightView, positions: Floats, shafts: Visits, start: int) -> None:
        """One ray a light point, from the nodes that the shafts of their points have met."""
        points, first = np.unique(shafts.rays, return_index=True)
        step = max(1, RAYS // view.light_points.count)
        ends = np.append(first, shafts.rays.size)
        for low in range(0, points.size, step):
            high = min(low + step, points.size)
            part = slice(ends[low], ends[high])
            index = points[low:high] + start
            own = np.repeat(np.arange(high - low), np.diff(ends[low : high + 1]))
            hidden = self._hidden(view, positions[:, index], index, own, shafts.nodes[part])
            if hidden.any():
                view.block(hidden, index)

    def _hidden(
        self, view: LightView, positions: Floats, index: Integers, owners: Integers, nodes: Integers
    ) -> Masks:
        """Pairs (L, m) with a triangle between; `owners` (P,) are at `nodes` (P,)."""
        towards = self._towards(view, positions, index)
        lights, count = towards.shape[1:]
        rays = (owners[:, None] * lights + np.arange(lights)).reshape(-1)
        directions = towards.transpose(0, 2, 1).reshape(3, -1)
        origins = positions.repeat(lights, axis=1)
        reach = np.full(rays.max() + 1 if rays.size else 0, 1.0 if self.emitter.weight else np.inf)
        begin = Visits(rays, nodes.repeat(lights), np.zeros(rays.size))
        visits = visits_of_rays(self.tree.levels[SHAFT_LEVELS:], origins, directions, reach, begin)
        blocked = np.zeros(directions.shape[1], dtype=bool)
        self._block(view, visits, origins, directions, index.repeat(lights), blocked)
        return blocked.reshape(count, lights).T

    def _towards(self, view: LightView, positions: Floats, index: Integers) -> Floats:
        """Light points minus points, (3, L, m)."""
        emitter = self.emitter
        u, v = view.light_points.places(index)
        centre = emitter.towards(positions)
        return np.stack([centre[i] + u * emitter.first[i] + v * emitter.second[i] for i in range(3)])

    def _block(
        self, view: LightView, visits: Visits, origins: Floats, directions: Floats, points: Integers, blocked: Masks
    ) -> None:
        """Look into leaves, one a ray at a time, until the ray is blocked or has no more."""
        order = np.argsort(visits.rays, kind="stable")
        rays, leaves = visits.rays[order], visits.nodes[order]
        rank = np.arange(rays.size) - np.searchsorted(rays, rays)
        first, last = 0, 1
        while rank.size and first <= rank.max():
            now = np.flatnonzero((rank >= first) & (rank < last) & ~blocked[rays])
            items = self.tree.items[leaves[now]]
            filled = items != NOTHING
            ray, triangle = np.broadcast_to(rays[now, None], items.shape)[filled], items[filled]
            blocked[self._stopped(view, origins, directions, points, ray, triangle)] = True
            first, last = last, 2 * last

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
        inside = woop.inside(self.family.vertices[:, :, triangles], origins[:, rays], directions[:, rays])
        rays, triangles = rays[inside], triangles[inside]
        start = self._start_distances(view, origins[:, rays], points[rays], triangles)
        end = self._end_distances(origins[:, rays], directions[:, rays], triangles)
        return rays[start * end < 0]

    def _start_distances(
        self, view: LightView, positions: Floats, points: Integers, triangles: Integers
    ) -> Floats:
        """Sides of the planes (P,) that the points are on, 0 for a triangle's own points."""
        family = self.family
        normals, anchors = family.normals[:, triangles], family.vertices[0][:, triangles]
        rounding = SURFACE * (view.of_points(view.points.sizes)[points] + family.sizes[triangles])
        origins = view.origins if view.origins.shape[1] == 1 else view.origins[:, points]
        sides = np.sign(dot(normals, origins - anchors))
        own = (family.numbers[triangles] == view.of_points(view.points.shapes)[points]) & (
            family.primitives[triangles] == view.of_points(view.points.primitives)[points]
        )
        distances = snapped(dot(normals, positions - anchors), rounding, sides)
        return np.where(own, 0.0, np.sign(distances))

    def _end_distances(self, positions: Floats, directions: Floats, triangles: Integers) -> Floats:
        """Sides of the planes (P,) that the light points are on, 0 where they touch."""
        family, emitter = self.family, self.emitter
        normals, anchors = family.normals[:, triangles], family.vertices[0][:, triangles]
        light_points = directions + emitter.weight * positions
        distances = dot(normals, light_points - emitter.weight * anchors)
        rounding = SURFACE * (family.sizes[triangles] * emitter.weight + emitter.scale)
        return np.where(np.abs(distances) <= rounding, 0.0, np.sign(distances))
