"""Shadows of planar convex shapes.

With signed distances s from the occluder's plane and edge functions a, the segment from p to q passes
the plane where s_p and s_q have opposite signs, at (|s_q| p + |s_p| q) / (|s_p| + |s_q|). It is inside an
edge iff |s_q| a_p + |s_p| a_q >= 0. All four are formed in float64; what the pair work makes of them depends
on whether all points share the light points (`polygon_grids`) or not (`polygon_scatter`).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from renderer.accelerators.boxes import Boxes
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.math.numerics import PLANE_ERROR
from renderer.self_intersection import settled
from renderer.shapes.polygons import Polygons
from renderer.visibility.culling import bounds, shaft


def signed(normals: Floats, anchors: Floats, x: Floats, weight: float) -> Floats:
    """Products normals . (x - weight anchors): (3, K) and (3, N) -> (K, N), differences first."""
    parts = [normals[i][:, None] * (x[i][None, :] - weight * anchors[i][:, None]) for i in range(3)]
    return parts[0] + parts[1] + parts[2]


@dataclass(slots=True, eq=False)
class PolygonShadows(ABC):
    """Shadow stage: polygons between points and one light."""

    occluders: Polygons
    emitter: Emitter
    dtype: np.dtype[np.floating]
    culling: bool
    boxes: Boxes = field(init=False)
    ends: Floats = field(init=False)

    def __post_init__(self) -> None:
        """Form all that does not depend on the points."""
        self.boxes = Boxes.around(self.occluders.corners)
        self.ends = signed(
            self.occluders.normals, self.occluders.anchors, self.emitter.ends(), self.emitter.weight
        )

    @abstractmethod
    def mark(self, view: LightView, positions: Floats, candidates: Integers, distances: Floats) -> None:
        """Mark the pairs that polygons block.

        Parameters
        ----------
        view : LightView
        positions : (3, n) float64
        candidates : (K,) int64
            Polygons that may block some pair.
        distances : (K, n) float64
            Signed distances of the points from their planes.
        """

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        positions = view.of_points(view.points.positions)
        candidates = self.candidates(view, positions)
        if candidates.size:
            self.mark(view, positions, candidates, self._distances(view, positions, candidates))

    def candidates(self, view: LightView, positions: Floats) -> Integers:
        """Polygons (K,) that may stand between some of the points at `positions` (3, n) and the light."""
        candidates = np.arange(self.occluders.numbers.size)
        if self.culling:
            low, high = bounds(positions)
            near = shaft(self.boxes, low, high, self.emitter)
            near[near] = ~self._beside(view, low, high, np.flatnonzero(near))
            candidates = candidates[near]
        return candidates

    def _beside(self, view: LightView, low: Floats, high: Floats, candidates: Integers) -> Masks:
        """Polygons whose plane has the light and the bounds of the points strictly on one side, (K,)."""
        normals = self.occluders.normals[:, candidates]
        middle = dot(normals, (low + high) / 2 - self.occluders.anchors[:, candidates])
        reach = dot(np.abs(normals), (high - low) / 2)
        sizes = self.occluders.sizes[candidates]
        margin = 2 * PLANE_ERROR * (float(view.points.sizes.max()) + sizes)
        light = PLANE_ERROR * (sizes * self.emitter.weight + self.emitter.scale)
        ends = self.ends[candidates]
        above = (middle - reach > margin) & (ends.min(axis=1) > -light)
        below = (middle + reach < -margin) & (ends.max(axis=1) < light)
        return above | below

    def _distances(self, view: LightView, positions: Floats, candidates: Integers) -> Floats:
        """Signed distances (K, n) whose signs hold.

        They are 0 for a polygon's own points: a plane never shades itself, but another face of its mesh may.
        """
        occluders = self.occluders
        normals, anchors = occluders.normals[:, candidates], occluders.anchors[:, candidates]
        distances = signed(normals, anchors, positions, 1.0)
        sides = np.sign(signed(normals, anchors, view.origins, 1.0))
        own = (occluders.numbers[candidates][:, None] == view.of_points(view.points.shapes)) & (
            occluders.primitives[candidates][:, None] == view.of_points(view.points.primitives)
        )
        return settled(distances, self.rounding(view, candidates), sides, own)

    def rounding(self, view: LightView, candidates: Integers) -> Floats:
        """Bounds on the error of the points' signed distances and edge functions, (K, n).

        Edge functions are raised by twice as much. A point in a corner of three walls touches the two that it
        is not on, and by rounding may lie beside their edges; raised, it is inside. It stands next to nothing
        away from either (`self_intersection.settled`): to a light behind both it goes through them, however
        sharp the corner.
        """
        sizes = view.of_points(view.points.sizes)
        return PLANE_ERROR * (sizes[None, :] + self.occluders.sizes[candidates][:, None])
