"""Shadows of planar shapes where all points share the light points.

|s_q| a_p + |s_p| a_q >= 0 is a_p / |s_p| >= -a_q / |s_q|: a number of the point against a number of the light
point, each formed in float64 and rounded once. The pair work is one comparison an edge.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, Pairs
from renderer.math.numerics import PLANE_ERROR, outward
from renderer.shapes.polygons import Polygons
from renderer.visibility.polygons import PolygonShadows, signed

MAX_RATIO = float(np.finfo(np.float64).max)
"""Clamp for infinite edge ratios, which could not be rounded outward."""


@dataclass(slots=True, eq=False)
class SharedLight:
    """Light points of a grid that all points share, prepared for pair work.

    Attributes
    ----------
    sides : (L, K) float64
        Side of each occluder's plane that a light point is on: -1, 1, or 0 where it touches the plane.
    present : (2, K) bool
        Whether some light point is below, and above.
    thresholds : (E, L, K) float
        -a_q / |s_q|, lowered by some spacings; a point is inside an edge from its own number up.
    least : (E, 2, K) float
        Least threshold over the light points below and above.
    """

    sides: Floats
    present: Masks
    thresholds: Pairs
    least: Floats


def shared_light(occluders: Polygons, emitter: Emitter, dtype: np.dtype[np.floating]) -> SharedLight:
    """Prepare the shared light points of an emitter once."""
    q = emitter.shared_points()
    distance = signed(occluders.normals, occluders.anchors, q, emitter.weight)
    touching = np.abs(distance) <= PLANE_ERROR * (occluders.sizes[:, None] * emitter.weight + emitter.scale)
    distance = np.where(touching, 0.0, distance)
    sides = np.sign(distance).T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        numbers = [
            signed(n, a, q, emitter.weight) / np.abs(distance)
            for n, a in zip(occluders.edge_normals, occluders.edge_anchors, strict=True)
        ]
        thresholds = np.stack([-outward(np.nan_to_num(number), dtype).T for number in numbers])
    least = np.stack([np.where(sides == side, thresholds, np.inf).min(axis=1) for side in (-1, 1)], axis=1)
    present = np.stack([(sides == side).any(axis=0) for side in (-1, 1)])
    return SharedLight(sides=sides, present=present, thresholds=thresholds, least=least)


@dataclass(slots=True, eq=False)
class GridPolygonShadows(PolygonShadows):
    """Shadow stage: polygons between points and the light points that they share."""

    light: SharedLight = field(init=False)

    def __post_init__(self) -> None:
        """Form the numbers of the light points once."""
        PolygonShadows.__post_init__(self)
        self.light = shared_light(self.occluders, self.emitter, self.dtype)

    def mark(self, view: LightView, positions: Floats, candidates: Integers, distances: Floats) -> None:
        """Compare numbers of points with numbers of light points on the other side of each plane."""
        light = self.light
        crossing: list[Masks] = [
            (distances > 0) & light.present[0, candidates, None],
            (distances < 0) & light.present[1, candidates, None],
        ]
        rows = np.flatnonzero(np.logical_or(*crossing).any(axis=1))
        if not rows.size:
            return
        numbers = self._edge_numbers(view, positions, candidates[rows], distances[rows])
        # 0 / 0 stays NaN: such a point lies on the plane, crosses nothing, and is not compared.
        alphas = [
            outward(np.clip(number, -MAX_RATIO, MAX_RATIO, out=number), self.dtype) for number in numbers
        ]
        for row, shape in enumerate(candidates[rows].tolist()):
            for side, mask in enumerate(crossing):
                possible = mask[rows[row]]
                if self.culling:
                    for alpha, least in zip(alphas, light.least[:, side, shape], strict=True):
                        possible = possible & (alpha[row] >= least)
                index = np.flatnonzero(possible)
                if index.size:
                    self._compare(view, [alpha[row][index] for alpha in alphas], index, (shape, side))

    def _compare(self, view: LightView, alphas: list[Pairs], index: Integers, which: tuple[int, int]) -> None:
        """Compare the points `index`, which may be blocked, with all light points on the other side."""
        (shape, side), light = which, self.light
        workspace, count = view.workspace, light.sides.shape[0]
        inside = workspace.masks("inside", count, index.size)
        edge = workspace.masks("edge", count, index.size)
        opposite = light.sides[:, shape] == (-1.0, 1.0)[side]
        inside[...] = opposite[:, None]
        for alpha, thresholds in zip(alphas, light.thresholds[:, :, shape], strict=True):
            if alpha.min() < thresholds[opposite].max():
                np.greater_equal(alpha[None, :], thresholds[:, None], out=edge)
                np.logical_and(inside, edge, out=inside)
        view.block(inside, None if index.size == view.count else index)

    def _edge_numbers(
        self, view: LightView, positions: Floats, candidates: Integers, distances: Floats
    ) -> list[Floats]:
        room, spans = 2 * self.rounding(view, candidates), np.abs(distances)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return [
                (signed(n[:, candidates], a[:, candidates], positions, 1.0) + room) / spans
                for n, a in zip(self.occluders.edge_normals, self.occluders.edge_anchors, strict=True)
            ]
