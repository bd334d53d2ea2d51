"""Shadow rays of the textbooks: one for every pair of a place, a step off its surface, and a light point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.pairs import light_places, starts, ways
from benchmarks.textbook.single import Singles, buffer, dot
from renderer.math.arrays import cross
from renderer.math.arrays import dot as plain_dot
from renderer.visibility.culling import bounds, shaft

if TYPE_CHECKING:
    from renderer.lights.view import LightView
    from renderer.math.arrays import Masks
    from renderer.shapes.ellipsoids import Ellipsoids
    from renderer.shapes.polygons import Polygons
    from renderer.visibility.ellipsoids import EllipsoidShadows
    from renderer.visibility.polygons import PolygonShadows


@dataclass(frozen=True, slots=True)
class FlatShadowRays:
    """Shadow stage: triangles or parallelograms between points and light points.

    Attributes
    ----------
    occluders : Polygons
        In float32.
    culling : PolygonShadows
        The renderer's stage, which knows what cannot be in the way of a block.
    """

    occluders: Polygons
    culling: PolygonShadows

    def run(self, view: LightView) -> None:
        """Mark the pairs whose shadow ray hits a shape."""
        candidates = self.culling.candidates(view, view.of_points(view.points.positions))
        if not candidates.size:
            return
        places = starts(view)
        directions = ways(places, light_places(view))
        for shape in candidates.tolist():
            view.block(self._met(view, places, directions, shape))

    def _met(self, view: LightView, places: Singles, directions: list[Singles], shape: int) -> Masks:
        """By Moeller and Trumbore (1997), with their triple products turned as for hits, (L, n)."""
        first_corner, *others = self.occluders.corners[:3, :, shape : shape + 1]
        first, second = (corner - first_corner for corner in others)
        away = places - first_corner
        beside = cross(away, first)
        shape_of_pairs = view.light_points.count, view.count
        determinant, u, v, spare = (
            buffer(name, *shape_of_pairs) for name in ("determinant", "u", "v", "spare")
        )
        np.reciprocal(dot(directions, cross(second, first), determinant, spare), out=determinant)
        np.multiply(dot(directions, cross(second, away), u, spare), determinant, out=u)
        np.multiply(dot(directions, beside, v, spare), determinant, out=v)
        t = np.multiply(plain_dot(second, beside), determinant, out=determinant)
        hit, part = (view.workspace.masks(name, *shape_of_pairs) for name in ("hit", "part"))
        np.logical_and(np.greater(t, 0, out=hit), np.less(t, 1, out=part), out=hit)
        np.logical_and(hit, np.greater_equal(u, 0, out=part), out=hit)
        np.logical_and(hit, np.greater_equal(v, 0, out=part), out=hit)
        if len(self.occluders.corners) == 3:
            return np.logical_and(hit, np.less_equal(np.add(u, v, out=u), 1, out=part), out=hit)
        np.logical_and(hit, np.less_equal(u, 1, out=part), out=hit)
        return np.logical_and(hit, np.less_equal(v, 1, out=part), out=hit)


@dataclass(frozen=True, slots=True)
class RoundShadowRays:
    """Shadow stage: ellipsoids between points and light points.

    Attributes
    ----------
    family : Ellipsoids
        In float32.
    culling : EllipsoidShadows
        The renderer's stage, which knows what cannot be in the way of a block.
    """

    family: Ellipsoids
    culling: EllipsoidShadows

    def run(self, view: LightView) -> None:
        """Mark the pairs whose shadow ray hits an ellipsoid."""
        positions = view.of_points(view.points.positions)
        near = shaft(self.culling.boxes, *bounds(positions), self.culling.emitter)
        for shape in np.flatnonzero(near).tolist():
            view.block(self._met(view, shape))

    def _met(self, view: LightView, shape: int) -> Masks:
        """By the roots of a t^2 + 2 b t + c in the unit sphere's frame, (L, n)."""
        rows = self.family.inverse[:, :, shape, None]
        center = self.family.centers[:, shape, None]
        relative, lights = starts(view) - center, light_places(view) - center[:, :, None]
        origin = np.stack([plain_dot(relative, row) for row in rows])
        directions = ways(origin, np.stack([plain_dot(lights, row) for row in rows]))
        outside = plain_dot(origin, origin) - 1
        shape_of_pairs = view.light_points.count, view.count
        a, b, root, spare = (buffer(name, *shape_of_pairs) for name in ("a", "b", "root", "spare"))
        dot(directions, directions, a, spare)
        dot(directions, origin, b, spare)
        np.subtract(np.multiply(b, b, out=root), np.multiply(a, outside, out=spare), out=root)
        hit, part = (view.workspace.masks(name, *shape_of_pairs) for name in ("hit", "part"))
        np.greater_equal(root, 0, out=hit)
        np.sqrt(np.maximum(root, 0, out=root), out=root)
        # Rays that begin outside enter at the first root, others leave at the second.
        np.multiply(root, -np.sign(outside), out=root)
        reached = np.subtract(root, b, out=root)
        np.logical_and(hit, np.greater(reached, 0, out=part), out=hit)
        return np.logical_and(hit, np.less(reached, a, out=part), out=hit)
