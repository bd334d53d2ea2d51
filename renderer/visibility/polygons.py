"""Shadows of planar convex shapes.

With signed distances s from the occluder's plane and edge functions a, the segment from p to q passes
the plane where s_p and s_q have opposite signs, at (|s_q| p + |s_p| q) / (|s_p| + |s_q|). It is inside an
edge iff |s_q| a_p + |s_p| a_q >= 0, that is iff a_p / |s_p| >= -a_q / |s_q|: a number of the point against a
number of the light point. Both are formed in float64 and rounded once; the pair work is one comparison an
edge.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.arrays import Floats, Integers, Masks, Pairs, dot
from renderer.lights.emitters import Emitter
from renderer.lights.samples import Scatter
from renderer.lights.view import LightView
from renderer.numerics import SURFACE, outward, snapped
from renderer.shapes.polygons import Polygons
from renderer.visibility.culling import Box, shaft


def _signed(normals: Floats, anchors: Floats, x: Floats, weight: float) -> Floats:
    """Normals . (x - weight anchors): (3, K) and (3, N) -> (K, N), differences first."""
    parts = [normals[i][:, None] * (x[i][None, :] - weight * anchors[i][:, None]) for i in range(3)]
    return parts[0] + parts[1] + parts[2]


@dataclass(slots=True)
class SharedLight:
    """What the pair work needs of light points that all points share.

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
    distance = _signed(occluders.normals, occluders.anchors, q, emitter.weight)
    touching = np.abs(distance) <= SURFACE * (
        occluders.sizes[:, None] * emitter.weight + max(emitter.size, 1 - emitter.weight)
    )
    distance = np.where(touching, 0.0, distance)
    sides = np.sign(distance).T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        numbers = [
            _signed(n, a, q, emitter.weight) / np.abs(distance)
            for n, a in zip(occluders.edge_normals, occluders.edge_anchors, strict=True)
        ]
        thresholds = np.stack([-outward(np.nan_to_num(number), dtype).T for number in numbers])
    least = np.stack([np.where(sides == side, thresholds, np.inf).min(axis=1) for side in (-1, 1)], axis=1)
    present = np.stack([(sides == side).any(axis=0) for side in (-1, 1)])
    return SharedLight(sides=sides, present=present, thresholds=thresholds, least=least)


@dataclass(slots=True)
class PolygonShadows:
    """Shadow stage: polygons between points and one light."""

    occluders: Polygons
    emitter: Emitter
    dtype: np.dtype[np.floating]
    culling: bool
    box: Box = field(init=False)
    light: SharedLight | None = field(init=False)

    def __post_init__(self) -> None:
        """Form all that does not depend on the points."""
        self.box = Box.of(self.occluders.corners)
        self.light = shared_light(self.occluders, self.emitter, self.dtype) if self.emitter.shared else None

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        positions = view.of_points(view.points.positions)
        candidates = np.arange(self.occluders.numbers.size)
        if self.culling:
            candidates = np.flatnonzero(shaft(self.box, positions, self.emitter))
        if not candidates.size:
            return
        distances = self._distances(view, positions, candidates)
        if self.light is not None:
            self._shared(view, positions, candidates, distances, self.light)
        else:
            self._scattered(view, positions, candidates, distances)

    def _distances(self, view: LightView, positions: Floats, candidates: Integers) -> Floats:
        """Signed distances (K, n) whose signs hold.

        They are 0 for a shape's own points: a plane never shades itself.
        """
        occluders = self.occluders
        normals, anchors = occluders.normals[:, candidates], occluders.anchors[:, candidates]
        distances = _signed(normals, anchors, positions, 1.0)
        sizes = view.of_points(view.points.sizes)
        bounds = SURFACE * (sizes[None, :] + occluders.sizes[candidates][:, None])
        sides = np.sign(_signed(normals, anchors, view.origins, 1.0))
        own = occluders.numbers[candidates][:, None] == view.of_points(view.points.shapes)[None, :]
        return np.where(own, 0.0, snapped(distances, bounds, sides))

    def _edge_numbers(self, positions: Floats, candidates: Integers, distances: Floats) -> list[Floats]:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return [
                _signed(n[:, candidates], a[:, candidates], positions, 1.0) / np.abs(distances)
                for n, a in zip(self.occluders.edge_normals, self.occluders.edge_anchors, strict=True)
            ]

    def _shared(
        self, view: LightView, positions: Floats, candidates: Integers, distances: Floats, light: SharedLight
    ) -> None:
        crossing: list[Masks] = [
            (distances > 0) & light.present[0, candidates, None],
            (distances < 0) & light.present[1, candidates, None],
        ]
        rows = np.flatnonzero(np.logical_or(*crossing).any(axis=1))
        if not rows.size:
            return
        numbers = self._edge_numbers(positions, candidates[rows], distances[rows])
        alphas = [outward(np.nan_to_num(number), self.dtype) for number in numbers]
        for row, shape in enumerate(candidates[rows].tolist()):
            for side, mask in enumerate(crossing):
                possible = mask[rows[row]]
                if self.culling:
                    for alpha, least in zip(alphas, light.least[:, side, shape], strict=True):
                        possible = possible & (alpha[row] >= least)
                index = np.flatnonzero(possible)
                if index.size:
                    self._mark(view, [alpha[row][index] for alpha in alphas], index, light, (shape, side))

    def _mark(
        self,
        view: LightView,
        alphas: list[Pairs],
        index: Integers,
        light: SharedLight,
        which: tuple[int, int],
    ) -> None:
        """Compare the points `index`, which may be blocked, with all light points on the other side."""
        shape, side = which
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

    def _scattered(self, view: LightView, positions: Floats, candidates: Integers, distances: Floats) -> None:
        for row, shape in enumerate(candidates.tolist()):
            index = self._possible(distances[row], shape)
            if index.size:
                view.block(
                    self._crossings(view, positions[:, index], distances[row][index], shape, index), index
                )

    def _possible(self, distance: Floats, shape: int) -> Integers:
        """Points with some place of the light on the other side of the plane."""
        ends = self.emitter.ends()
        one = slice(shape, shape + 1)
        q = _signed(
            self.occluders.normals[:, one], self.occluders.anchors[:, one], ends, self.emitter.weight
        )[0]
        slack = SURFACE * (self.occluders.sizes[shape] + self.emitter.size)
        possible = (distance > 0) & (q.min() < slack) | (distance < 0) & (q.max() > -slack)
        return np.flatnonzero(possible)

    def _crossings(
        self, view: LightView, positions: Floats, distance: Floats, shape: int, index: Integers
    ) -> Masks:
        """Blocked pairs (L, m) by |s_q| a_p + |s_p| a_q >= 0, all four relative to their own scale."""
        one, emitter, workspace = slice(shape, shape + 1), self.emitter, view.workspace
        lights = view.light_points.chosen(index)
        if not isinstance(lights, Scatter):
            raise TypeError("shared light points have their own path")
        rows, count = lights.count, index.size

        def buffer(name: str) -> Pairs:
            return workspace.pairs(name, rows, count, self.dtype)

        def on_light(normals: Floats, anchors: Floats, slack: float, out: Pairs) -> Pairs:
            constant = _signed(normals, anchors, emitter.centre, emitter.weight)[0] + slack
            by_u, by_v = dot(normals, emitter.first), dot(normals, emitter.second)
            return lights.affine((constant, by_u, by_v), out, workspace)

        side = np.sign(distance)
        scale = float(np.finfo(self.dtype).eps) * 8 * (emitter.size + self.occluders.sizes[shape])
        plane = on_light(self.occluders.normals[:, one], self.occluders.anchors[:, one], 0.0, buffer("plane"))
        np.multiply(plane, -side.astype(self.dtype), out=plane)
        inside = plane > 0
        with np.errstate(over="ignore", invalid="ignore"):
            for normals, anchors in zip(
                self.occluders.edge_normals, self.occluders.edge_anchors, strict=True
            ):
                of_point = _signed(normals[:, one], anchors[:, one], positions, 1.0)[0] / np.abs(distance)
                edge = on_light(normals[:, one], anchors[:, one], scale, buffer("edge"))
                other = np.multiply(plane, outward(of_point, self.dtype), out=buffer("other"))
                np.add(edge, other, out=edge)
                inside &= edge >= 0
        return inside
