"""Shadows factored as in the renderer, one comparison an edge and pair, with nothing done about rounding.

They are in float32 throughout; points stand a step off their surfaces, as the textbooks have it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.pairs import stepped
from renderer.math.arrays import dot, taken
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygon_grids import GridPolygonShadows
from renderer.visibility.polygons import signed

if TYPE_CHECKING:
    from benchmarks.textbook.single import Singles
    from renderer.lights.view import LightView
    from renderer.math.arrays import Floats, Integers


@dataclass(slots=True, eq=False)
class BareFlatShadows(GridPolygonShadows):
    """Shadow stage: polygons in float32 between points and the light points that they share."""

    def mark(self, view: LightView, positions: Floats, candidates: Integers, distances: Floats) -> None:
        """Compare numbers of points with numbers of light points on the other side of each plane."""
        crossing = [
            (distances > 0) & self.light.present[0, candidates, None],
            (distances < 0) & self.light.present[1, candidates, None],
        ]
        rows = np.flatnonzero(np.logical_or(*crossing).any(axis=1))
        if not rows.size:
            return
        places = stepped(positions, view.of_points(view.points.normals))
        numbers = self._numbers(places, candidates[rows], np.abs(distances[rows]))
        for row, shape in enumerate(candidates[rows].tolist()):
            for side, mask in enumerate(crossing):
                possible = mask[rows[row]]
                for number, least in zip(numbers, self.light.least[:, side, shape], strict=True):
                    possible = possible & (number[row] >= least)
                index = np.flatnonzero(possible)
                if index.size:
                    self._compare(view, [number[row][index] for number in numbers], index, (shape, side))

    def _distances(self, view: LightView, positions: Floats, candidates: Integers) -> Floats:
        normals, anchors = self.occluders.normals[:, candidates], self.occluders.anchors[:, candidates]
        return signed(normals, anchors, stepped(positions, view.of_points(view.points.normals)), 1.0)

    def _numbers(self, places: Singles, candidates: Integers, spans: Singles) -> list[Singles]:
        """a_p / |s_p| of every edge, (K, n) each."""
        edges = zip(self.occluders.edge_normals, self.occluders.edge_anchors, strict=True)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return [signed(n[:, candidates], a[:, candidates], places, 1.0) / spans for n, a in edges]


@dataclass(slots=True)
class BareRoundShadows(EllipsoidShadows):
    """Shadow stage: ellipsoids in float32 between points and one light."""

    def _shade(self, view: LightView, shape: int, positions: Floats, index: Integers) -> None:
        places = stepped(positions, taken(view.of_points(view.points.normals), index))
        relative = self.family.to_sphere(places - self.family.centers[:, shape, None], shape)
        squares = dot(relative, relative)
        power = np.maximum(squares - 1, 0)
        self._shade_outer(view, shape, relative, np.sqrt(squares), power, index)
