"""Shadows of ellipsoids.

In the frame where the ellipsoid is the unit sphere, let D > 1 be the point's distance from the centre and
q_a the part of the light point along the point's direction, q_x and q_y the parts across it. The sphere's
tangents from the point form a cone; the light point is hidden iff it lies in the cone,
(q_x^2 + q_y^2)(D^2 - 1) < (D - q_a)^2, and beyond the circle of contact, q_a D < 1. All three parts are
affine in the light point, formed in float64 about the centre and rounded once, so a small sphere far away
keeps its silhouette: nothing cancels in the pair work.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.accelerators.boxes import Boxes
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, taken
from renderer.math.numerics import gamma
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.frames import frame_of_normals
from renderer.visibility.culling import SHAFT_MARGIN, bounds, shaft

MAX_PAIR_NUMBER = 2.0**60
"""Largest number in pair work: its square is finite in float32. Lights are larger, in radii of tiny balls."""


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """Affine functions (constant, by u, by v), each (3, n): across, across and down the cone's axis.

    The light point is hidden where x^2 + y^2 < down^2 and down > contact. Scaled per point, `down` to be
    near 1, or less where x and y would be beyond `MAX_PAIR_NUMBER`.
    """

    x: Floats
    y: Floats
    down: Floats
    contact: Floats

    def possible(self) -> Masks:
        """Points from which some place of the light may be in the cone; generous by `SHAFT_MARGIN`, (n,)."""

        def beside(part: Floats) -> Floats:
            return np.maximum(np.abs(part[0]) - np.abs(part[1]) / 2 - np.abs(part[2]) / 2 - SHAFT_MARGIN, 0.0)

        deepest = self.down[0] + np.abs(self.down[1]) / 2 + np.abs(self.down[2]) / 2 + SHAFT_MARGIN
        return (np.hypot(beside(self.x), beside(self.y)) <= np.maximum(deepest, 0.0)) & (
            deepest >= self.contact
        )

    def at(self, index: Integers) -> "Cone":
        """The same at some points."""
        return Cone(taken(self.x, index), taken(self.y, index), taken(self.down, index), self.contact[index])


@dataclass(slots=True)
class EllipsoidShadows:
    """Shadow stage: ellipsoids between points and one light."""

    family: Ellipsoids
    emitter: Emitter
    dtype: np.dtype[np.floating]
    culling: bool
    boxes: Boxes = field(init=False)

    def __post_init__(self) -> None:
        """Form the bounds once."""
        self.boxes = Boxes.around(self.family.corners())

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view.

        The outer side of an ellipsoid shades its own points by their normals alone; from its inner side
        all that is outside is hidden.
        """
        positions = view.of_points(view.points.positions)
        candidates = np.arange(self.family.numbers.size)
        if self.culling:
            candidates = np.flatnonzero(shaft(self.boxes, *bounds(positions), self.emitter))
        if not candidates.size:
            return
        owners, flipped = view.of_points(view.points.shapes), view.of_points(view.points.flipped)
        for shape in candidates.tolist():
            own = owners == self.family.numbers[shape]
            within, others = np.flatnonzero(own & flipped), np.flatnonzero(~own)
            if within.size:
                self._shade_inner(view, shape, within)
            if others.size:
                self._shade(view, shape, taken(positions, others), others)

    def _shade(self, view: LightView, shape: int, positions: Floats, index: Integers) -> None:
        relative = self.family.to_sphere(positions - self.family.centers[:, shape, None], shape)
        distance = lengths(relative)
        power = (distance - 1) * (distance + 1)
        touching = np.abs(power) <= self._rounding(view, shape, index)
        power = np.where(touching, 0.0, power)
        inside = power < 0
        if inside.any():
            self._shade_inner(view, shape, index[inside])
        outer = np.flatnonzero(~inside)
        if outer.size:
            self._shade_outer(
                view, shape, taken(relative, outer), distance[outer], power[outer], index[outer]
            )

    def _rounding(self, view: LightView, shape: int, index: Integers) -> Floats:
        """Bound on the error of the squared distance of a computed point, in the sphere's frame."""
        shortest = 1 / lengths(self.family.inverse[:, :, shape].T).max()
        sizes = view.of_points(view.points.sizes)[index] + self.family.sizes[shape]
        return gamma(48) * sizes / shortest

    def _light(self, shape: int) -> tuple[Floats, Floats, Floats]:
        """Centre and edges of the light in the sphere's frame, (3, 1) each."""
        emitter = self.emitter
        centre = self.family.to_sphere(
            emitter.centre - emitter.weight * self.family.centers[:, shape, None], shape
        )
        return (
            centre,
            self.family.to_sphere(emitter.first, shape),
            self.family.to_sphere(emitter.second, shape),
        )

    def _cone(
        self, light: tuple[Floats, Floats, Floats], relative: Floats, distance: Floats, power: Floats
    ) -> Cone:
        away = relative / distance
        x_axis = frame_of_normals(away)
        y_axis = cross(away, x_axis)
        reach = distance + sum(lengths(part) for part in light)
        reach = reach * np.maximum(1.0, distance / MAX_PAIR_NUMBER)
        widened = np.sqrt(power) / reach
        weight = self.emitter.weight
        down = np.stack([-dot(away, part) / reach for part in light])
        down[0] += weight * distance / reach
        return Cone(
            x=np.stack([dot(x_axis, part) * widened for part in light]),
            y=np.stack([dot(y_axis, part) * widened for part in light]),
            down=down,
            contact=weight * power / distance / reach,
        )

    def _shade_outer(
        self, view: LightView, shape: int, relative: Floats, distance: Floats, power: Floats, index: Integers
    ) -> None:
        light = self._light(shape)
        within = self._inner_light_points(view, light, index)
        if within is not None:
            view.block(within, index)
        cone = self._cone(light, relative, distance, power)
        if self.culling:
            possible = np.flatnonzero(cone.possible())
            if not possible.size:
                return
            cone, index = cone.at(possible), index[possible]
        view.block(self._hidden(view, cone, index), None if index.size == view.count else index)

    def _hidden(self, view: LightView, cone: Cone, index: Integers) -> Masks:
        lights, workspace, n = view.light_points.chosen(index), view.workspace, index.size
        x, y, down = (
            workspace.pairs(name, lights.count, n, self.dtype) for name in ("plane", "edge", "other")
        )
        lights.affine((cone.x[0], cone.x[1], cone.x[2]), x, workspace)
        lights.affine((cone.y[0], cone.y[1], cone.y[2]), y, workspace)
        lights.affine((cone.down[0], cone.down[1], cone.down[2]), down, workspace)
        hidden = np.greater(
            down, cone.contact.astype(self.dtype), out=workspace.masks("inside", lights.count, n)
        )
        for part in (x, y, down):
            np.multiply(part, part, out=part)
        np.add(x, y, out=x)
        within = np.less(x, down, out=workspace.masks("edge", lights.count, n))
        return np.logical_and(hidden, within, out=hidden)

    def _inner_light_points(
        self, view: LightView, light: tuple[Floats, Floats, Floats], index: Integers
    ) -> Masks | None:
        """Pairs whose light point is inside the ellipsoid, (L, m); None if no light point can be."""
        middle, reach = lengths(light[0]).item(), (lengths(light[1]).item() + lengths(light[2]).item()) / 2
        if self.emitter.weight == 0 or middle - reach > 1 + SHAFT_MARGIN:
            return None
        radius = 1 / max(1.0, (middle + reach) / MAX_PAIR_NUMBER)
        lights = view.light_points.chosen(index)
        total = np.zeros((lights.count, index.size), dtype=self.dtype)
        part = np.empty_like(total)
        for axis in range(3):
            constant, by_u, by_v = (np.broadcast_to(piece[axis] * radius, index.shape) for piece in light)
            lights.affine((constant, by_u, by_v), part, view.workspace)
            total += part * part
        return total < radius * radius

    def _shade_inner(self, view: LightView, shape: int, index: Integers) -> None:
        """From inside, all that is outside is hidden."""
        inner = self._inner_light_points(view, self._light(shape), index)
        mask = np.ones((view.light_points.count, index.size), dtype=bool) if inner is None else ~inner
        view.block(mask, index)
