"""Shadows of planar shapes where every point has light points of its own.

On the light, |s_q| a_p + |s_p| a_q is affine in u and v with coefficients of the point: formed in float64 and
rounded once, an edge costs one affine function and one comparison a pair.
"""

from dataclasses import dataclass

import numpy as np

from renderer.lights.samples import LightPoints, Terms
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, dot, taken
from renderer.math.numerics import PLANE_ERROR, unit_of
from renderer.visibility.polygons import PolygonShadows, signed

ROUNDING_ERROR = 2.0**-19
"""Bound on the float32 rounding error of an affine function on a light, relative to its terms."""


@dataclass(frozen=True, slots=True, eq=False)
class _Near:
    """Points (m,) that a polygon may matter to.

    Attributes
    ----------
    positions : (3, m) float64
    distance, rounding : (m,) float64
        From its plane, and the bound on the error of that.
    index : (m,) int64
        Indices of the view's points.
    """

    positions: Floats
    distance: Floats
    rounding: Floats
    index: Integers

    def part(self, chosen: Integers) -> "_Near":
        """Some of the points."""
        return _Near(
            taken(self.positions, chosen), self.distance[chosen], self.rounding[chosen], self.index[chosen]
        )


@dataclass(slots=True, eq=False)
class ScatterPolygonShadows(PolygonShadows):
    """Shadow stage: polygons between points and light points of their own."""

    def mark(self, view: LightView, positions: Floats, candidates: Integers, distances: Floats) -> None:
        """Form each edge's function on the light for the points that it may matter to."""
        for row, shape in enumerate(candidates.tolist()):
            index = self._beyond(distances[row], shape)
            if index.size:
                self._mark_one(view, positions[:, index], distances[row][index], shape, index)

    def _beyond(self, distance: Floats, shape: int) -> Integers:
        """Points with some place of the light on the other side of the plane."""
        ends = self.ends[shape]
        slack = PLANE_ERROR * (self.occluders.sizes[shape] + self.emitter.scale)
        return np.flatnonzero((distance > 0) & (ends.min() < slack) | (distance < 0) & (ends.max() > -slack))

    def _mark_one(
        self, view: LightView, positions: Floats, distance: Floats, shape: int, index: Integers
    ) -> None:
        rounding = self.rounding(view, np.array([shape]))[0][index]
        near, edges = self._edges(_Near(positions, distance, rounding, index), shape)
        if near.index.size:
            view.block(self._hidden(view, edges, near.distance, shape, near.index), near.index)

    def _edges(self, near: "_Near", shape: int) -> tuple["_Near", list[Terms]]:
        """|s_q| a_p + |s_p| a_q for every edge as a function on the light; inside is positive.

        Only for the points, given first, that some light point may be inside of all edges for, and without
        the edges that all light points are inside of.
        """
        edges: list[Terms] = []
        for number in range(len(self.occluders.edge_normals)):
            terms = self._edge(near, shape, number)
            if self.culling:
                possible = np.flatnonzero(highest(terms) >= 0)
                if possible.size < near.index.size:
                    near, terms = near.part(possible), _at(terms, possible)
                    edges = [_at(earlier, possible) for earlier in edges]
                if not possible.size:
                    return near, []
                if np.all(lowest(terms) >= 0):
                    continue
            edges.append(terms)
        return near, edges

    def _edge(self, near: "_Near", shape: int, number: int) -> Terms:
        one = slice(shape, shape + 1)
        plane = self._on_light(shape, self.occluders.normals, self.occluders.anchors)
        normals, anchors = self.occluders.edge_normals[number], self.occluders.edge_anchors[number]
        of_point = signed(normals[:, one], anchors[:, one], near.positions, 1.0)[0] + 2 * near.rounding
        of_light = self._on_light(shape, normals, anchors)
        scale = np.abs(of_point) + np.abs(near.distance)
        there, here = of_point * -np.sign(near.distance) / scale, np.abs(near.distance) / scale
        constant, by_u, by_v = (there * s + here * a for s, a in zip(plane, of_light, strict=True))
        slack = 4 * float(np.finfo(self.dtype).eps) * (np.abs(constant) + np.abs(by_u) + np.abs(by_v))
        return constant + slack, by_u, by_v

    def _unit(self, shape: int) -> Floats:
        emitter = self.emitter
        return unit_of(self.occluders.sizes[shape] * emitter.weight + emitter.scale)

    def _on_light(self, shape: int, normals: Floats, anchors: Floats) -> Terms:
        """Signed distance of light points from a line or plane of one shape, in its unit."""
        emitter, unit, one = self.emitter, self._unit(shape), slice(shape, shape + 1)
        normals, anchors = normals[:, one], anchors[:, one]
        constant = signed(normals, anchors, emitter.centre, emitter.weight)[0]
        return constant * unit, dot(normals, emitter.first) * unit, dot(normals, emitter.second) * unit

    def _hidden(
        self, view: LightView, edges: list[Terms], distance: Floats, shape: int, index: Integers
    ) -> Masks:
        """Pairs (L, m) beyond the plane and inside of every edge."""
        lights, workspace = view.light_points.chosen(index), view.workspace
        values = workspace.pairs("edge", lights.count, index.size, self.dtype)
        edge = workspace.masks("edge", lights.count, index.size)
        hidden = self._other_side(view, lights, distance, shape)
        for terms in edges:
            lights.affine(terms, values, workspace)
            np.logical_and(hidden, np.greater_equal(values, 0, out=edge), out=hidden)
        return hidden

    def _other_side(self, view: LightView, lights: LightPoints, distance: Floats, shape: int) -> Masks:
        hidden = view.workspace.masks("inside", lights.count, distance.size)
        hidden[...] = True
        slack = PLANE_ERROR * (self.occluders.sizes[shape] + self.emitter.scale)
        if np.abs(self.ends[shape]).min() <= slack or np.ptp(np.sign(self.ends[shape])) > 0:
            plane = self._on_light(shape, self.occluders.normals, self.occluders.anchors)
            terms = tuple(np.broadcast_to(term, distance.shape) * -np.sign(distance) for term in plane)
            values = view.workspace.pairs("edge", lights.count, distance.size, self.dtype)
            lights.affine((terms[0] - slack * self._unit(shape), terms[1], terms[2]), values, view.workspace)
            np.greater(values, 0, out=hidden)
        return hidden


def highest(terms: Terms) -> Floats:
    """Bound on the largest value on the light after rounding, (n,)."""
    constant, by_u, by_v = terms
    reach = np.abs(by_u) + np.abs(by_v)
    return constant + reach / 2 + ROUNDING_ERROR * (np.abs(constant) + reach)


def lowest(terms: Terms) -> Floats:
    """Bound on the smallest value on the light after rounding, (n,)."""
    constant, by_u, by_v = terms
    return -highest((-constant, by_u, by_v))


def _at(terms: Terms, chosen: Integers) -> Terms:
    return terms[0][chosen], terms[1][chosen], terms[2][chosen]
