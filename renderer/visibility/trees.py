"""Shadows of many triangles.

Points walk the tree with the shaft to the whole light; what is left are pairs of point and triangle. From the
point p, an edge a, b of the triangle spans the plane through p with normal (a - p) x (b - p). The light point q
is inside of the edge iff that normal . (q - p) has the sign of the other edges': a function affine on the light,
formed in float64 and rounded once. For two triangles that share an edge it differs in sign alone, after rounding
too, so no light passes between them.
"""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import NOTHING, Bvh, visits_of_shafts
from renderer.arrays import Floats, Integers, Masks, Pairs, cross, dot, magnitude
from renderer.lights.emitters import Emitter
from renderer.lights.samples import Terms
from renderer.lights.view import LightView
from renderer.numerics import SURFACE, snapped
from renderer.shapes.triangles import Triangles
from renderer.visibility.polygon_scatter import highest, lowest

PORTION = 2048
"""Points that walk the tree together."""

PAIRS = 65536
"""Pairs of light point and (point, triangle) compared at once."""


@dataclass(slots=True)
class TreeShadows:
    """Shadow stage: triangles in a tree between points and one light.

    Attributes
    ----------
    family : Triangles
    tree : Bvh
    emitter : Emitter
    dtype : float32 or float64
        Of the pair work.
    """

    family: Triangles
    tree: Bvh
    emitter: Emitter
    dtype: np.dtype[np.floating]

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        positions = view.of_points(view.points.positions)
        ends = self.emitter.ends()
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        for start in range(0, view.count, PORTION):
            portion = positions[:, start : start + PORTION]
            visits = visits_of_shafts(self.tree, portion, low, high, self.emitter.weight)
            items = self.tree.items[visits.leaves]
            filled = items != NOTHING
            points = np.broadcast_to(visits.rays[:, None], items.shape)[filled] + start
            self._mark(view, positions, points, items[filled])

    def _mark(self, view: LightView, positions: Floats, points: Integers, triangles: Integers) -> None:
        """Compare pairs of point and triangle, sorted by point, with the light points."""
        distances = self._distances(view, positions, points, triangles)
        crossing = self._crossing(distances, triangles)
        points, triangles, distances = points[crossing], triangles[crossing], distances[crossing]
        edges = self._edges(positions[:, points], distances, triangles)
        possible = np.logical_and.reduce([highest(terms) >= 0 for terms in edges])
        points, triangles, distances = points[possible], triangles[possible], distances[possible]
        edges = [(a[possible], b[possible], c[possible]) for a, b, c in edges]
        step = max(64, PAIRS // view.light_points.count)
        for start in range(0, points.size, step):
            part = slice(start, start + step)
            terms = [(a[part], b[part], c[part]) for a, b, c in edges]
            hidden = self._hidden(view, points[part], distances[part], triangles[part], terms)
            self._add(view, points[part], hidden)

    def _distances(
        self, view: LightView, positions: Floats, points: Integers, triangles: Integers
    ) -> Floats:
        """Signed distances (P,) of points from planes of triangles, whose signs hold; 0 for their own."""
        family = self.family
        normals, anchors = family.normals[:, triangles], family.vertices[0][:, triangles]
        distances = dot(normals, positions[:, points] - anchors)
        rounding = SURFACE * (view.of_points(view.points.sizes)[points] + family.sizes[triangles])
        origins = view.origins if view.origins.shape[1] == 1 else view.origins[:, points]
        sides = np.sign(dot(normals, origins - anchors))
        own = (family.numbers[triangles] == view.of_points(view.points.shapes)[points]) & (
            family.primitives[triangles] == view.of_points(view.points.primitives)[points]
        )
        return np.where(own, 0.0, snapped(distances, rounding, sides))

    def _crossing(self, distances: Floats, triangles: Integers) -> Integers:
        """Pairs with some place of the light strictly on the other side of the plane."""
        constant, by_u, by_v = self._plane(triangles)
        reach = (np.abs(by_u) + np.abs(by_v)) / 2
        other = np.where(distances > 0, reach - constant, reach + constant)
        slack = SURFACE * (self.family.sizes[triangles] + self.emitter.scale)
        return np.flatnonzero((distances != 0) & (other > slack))

    def _plane(self, triangles: Integers) -> Terms:
        """Signed distance of light points from the triangles' planes, as functions on the light."""
        emitter = self.emitter
        normals, anchors = self.family.normals[:, triangles], self.family.vertices[0][:, triangles]
        constant = dot(normals, emitter.centre - emitter.weight * anchors)
        return constant, dot(normals, emitter.first), dot(normals, emitter.second)

    def _edges(self, positions: Floats, distances: Floats, triangles: Integers) -> list[Terms]:
        """Functions on the light that are not negative inside of each edge, as seen from the points."""
        emitter = self.emitter
        towards = emitter.centre - emitter.weight * positions
        corners = [vertex[:, triangles] - positions for vertex in self.family.vertices]
        # Seen from the front, where distances are positive, the corners run against the clock.
        side = -np.sign(distances)
        edges = []
        for start, end in ((0, 1), (1, 2), (2, 0)):
            normals = cross(corners[start], corners[end])
            scale = side / (magnitude(normals) * (magnitude(towards) + emitter.extent))
            edges.append(
                (
                    dot(normals, towards) * scale,
                    dot(normals, emitter.first) * scale,
                    dot(normals, emitter.second) * scale,
                )
            )
        return edges

    def _hidden(
        self, view: LightView, points: Integers, distances: Floats, triangles: Integers, edges: list[Terms]
    ) -> Masks:
        """Pairs (L, P) beyond the plane and inside of all edges."""
        lights, workspace = view.light_points.chosen(points), view.workspace
        values: Pairs = workspace.pairs("edge", lights.count, points.size, self.dtype)
        inside = workspace.masks("edge", lights.count, points.size)
        hidden = workspace.masks("inside", lights.count, points.size)
        hidden[...] = True
        for terms in edges:
            if lowest(terms).min() < 0:
                lights.affine(terms, values, workspace)
                np.logical_and(hidden, np.greater_equal(values, 0, out=inside), out=hidden)
        constant, by_u, by_v = self._plane(triangles)
        other = -np.sign(distances)
        slack = SURFACE * (self.family.sizes[triangles] + self.emitter.scale)
        beyond = (constant * other - slack, by_u * other, by_v * other)
        if lowest(beyond).min() <= 0:
            lights.affine(beyond, values, workspace)
            np.logical_and(hidden, np.greater(values, 0, out=inside), out=hidden)
        return hidden

    def _add(self, view: LightView, points: Integers, hidden: Masks) -> None:
        """Join the pairs of each point."""
        starts = np.flatnonzero(np.diff(points, prepend=-1))
        view.block(np.logical_or.reduceat(hidden, starts, axis=1), points[starts])
