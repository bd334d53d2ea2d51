"""Shadows of many triangles where few of them may matter to a point.

From the point p, an edge a, b of a triangle spans the plane through p with normal (a - p) x (b - p). The
light point q is inside of the edge iff that normal . (q - p) has the sign of the other edges': a function
affine on the light, formed in float64 and rounded once. For two triangles that share an edge it differs in
sign alone, after rounding too, so no light passes between them. A point on the edge itself may have been
rounded to either side of it: edges are moved out by as much, or light would leave a closed mesh there.
"""

from dataclasses import dataclass

import numpy as np

from renderer.lights.emitters import Emitter
from renderer.lights.samples import Terms
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, Pairs, cross, dot, magnitude, taken
from renderer.math.numerics import PLANE_ERROR, unit_of
from renderer.shapes.triangles import Triangles
from renderer.visibility.polygon_scatter import highest, lowest
from renderer.visibility.sides import rounding_of, start_sides

PAIRS_AT_ONCE = 16384
"""Pairs of point and triangle tested at once: their forty or so temporaries stay in cache."""


@dataclass(frozen=True, slots=True)
class PairShadows:
    """Compares pairs of point and triangle with the light points.

    Attributes
    ----------
    family : Triangles
    emitter : Emitter
    dtype : float32 or float64
        Of the work for each light point.
    """

    family: Triangles
    emitter: Emitter
    dtype: np.dtype[np.floating]

    def mark(self, view: LightView, positions: Floats, points: Integers, triangles: Integers) -> None:
        """Mark what the pairs (P,), sorted by point, block."""
        for start in range(0, points.size, PAIRS_AT_ONCE):
            part = slice(start, start + PAIRS_AT_ONCE)
            self._mark_part(view, positions, points[part], triangles[part])

    def _mark_part(self, view: LightView, positions: Floats, points: Integers, triangles: Integers) -> None:
        sides = start_sides(self.family, view, taken(positions, points), points, triangles)
        crossing = self._crossing(sides, triangles)
        points, triangles, sides = points[crossing], triangles[crossing], sides[crossing]
        rounding = rounding_of(self.family, view, points, triangles)
        edges = self._edges(taken(positions, points), sides, triangles, rounding)
        possible = np.logical_and.reduce([highest(terms) >= 0 for terms in edges])
        if not possible.any():
            return
        points, triangles, sides = points[possible], triangles[possible], sides[possible]
        edges = [(a[possible], b[possible], c[possible]) for a, b, c in edges]
        self._add(view, points, self._hidden(view, points, sides, triangles, edges))

    def _crossing(self, sides: Floats, triangles: Integers) -> Integers:
        """Pairs with some place of the light strictly on the other side of the plane."""
        constant, by_u, by_v = self._plane(triangles)
        reach = (np.abs(by_u) + np.abs(by_v)) / 2
        other = np.where(sides > 0, reach - constant, reach + constant)
        slack = PLANE_ERROR * (self.family.sizes[triangles] + self.emitter.scale)
        return np.flatnonzero((sides != 0) & (other > slack))

    def _plane(self, triangles: Integers) -> Terms:
        """Signed distance of light points from the triangles' planes, as functions on the light."""
        emitter = self.emitter
        family = self.family
        normals, anchors = (taken(values, triangles) for values in (family.normals, family.vertices[0]))
        constant = dot(normals, emitter.centre - emitter.weight * anchors)
        return constant, dot(normals, emitter.first), dot(normals, emitter.second)

    def _edges(self, positions: Floats, sides: Floats, triangles: Integers, rounding: Floats) -> list[Terms]:
        """Functions on the light that are not negative inside of each edge, as seen from the points."""
        emitter = self.emitter
        towards = emitter.centre - emitter.weight * positions
        corners = [taken(vertex, triangles) - positions for vertex in self.family.vertices]
        # Seen from the front, where sides are positive, the corners run against the clock.
        side = -sides
        edges = []
        for start, end in ((0, 1), (1, 2), (2, 0)):
            normals = cross(corners[start], corners[end])
            size = magnitude(normals)
            # A point on the line of the edge has no plane through both: it is on the border.
            size = np.where(size > 0, size, np.inf)
            scale = side / (size * (magnitude(towards) + emitter.extent))
            slack = rounding * magnitude(corners[end] - corners[start]) / size
            edges.append(
                (
                    dot(normals, towards) * scale + slack,
                    dot(normals, emitter.first) * scale,
                    dot(normals, emitter.second) * scale,
                )
            )
        return edges

    def _hidden(
        self, view: LightView, points: Integers, sides: Floats, triangles: Integers, edges: list[Terms]
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
        sizes, scale = self.family.sizes[triangles], self.emitter.scale
        unit = unit_of(sizes * self.emitter.weight + scale)
        other, slack = -sides * unit, PLANE_ERROR * (sizes + scale) * unit
        beyond = (constant * other - slack, by_u * other, by_v * other)
        if lowest(beyond).min() <= 0:
            lights.affine(beyond, values, workspace)
            np.logical_and(hidden, np.greater(values, 0, out=inside), out=hidden)
        return hidden

    def _add(self, view: LightView, points: Integers, hidden: Masks) -> None:
        """Join the pairs of each point."""
        starts = np.flatnonzero(np.diff(points, prepend=-1))
        view.block(np.logical_or.reduceat(hidden, starts, axis=1), points[starts])
