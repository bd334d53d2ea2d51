"""Culling of triangles beside the pyramid from a point to a rectangle light, in the light's own coordinates.

With the light's centre as origin and its edges as the first two axes, the place x is seen from the point p
at u = U / W on the light's plane, where U = x_u p_w - p_u x_w and W = p_w - x_w. A triangle with
U > W / 2 at all corners lies beyond the plane through p and the edge u = 1/2, and is in no segment to the
light; so at the other three edges. Nothing is divided, so corners behind the point are no special case.

A culled triangle blocks no pair: every comparison includes the rounding to float32.
"""

from dataclasses import dataclass

import numpy as np

from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Pairs, cross, dot, lengths, magnitude, unit
from renderer.math.numerics import gamma
from renderer.shapes.triangles import Triangles
from renderer.visibility.culling import SHAFT_MARGIN

HALF_EDGE = 0.5 + SHAFT_MARGIN
"""Half of the light's edge: pair work in float32 may move an occluder's edge by some 2**-21 of it."""

FRAME_ERROR = 2.0**-19
"""Bound on the error of U and of W / 2, in shares of the largest coordinates of triangles and of the point.

Eight roundings to float32, of 2**-24 each, of sums of two products; and as much again.
"""

FLOAT64_ROUNDING = 2.0**26 * gamma(32)
"""Relative error of a coordinate that float64 computes from the sizes.

2**26 because `FRAME_ERROR` takes it for a rounding to float32, and is then at least 2**7 times as large.
"""


@dataclass(frozen=True, slots=True, eq=False)
class LightFrame:
    """Triangles in the coordinates of a rectangle light.

    Attributes
    ----------
    size : float
        Sum of the magnitudes that form a light point, scene units.
    axes : tuple of (3, 1) float64
        Their products with x minus the light's centre are the coordinates of x.
    vertices : (3, 3, T) float32
        Vertex, coordinate, triangle.
    reach : float
        Bound on the coordinates, with what rounding adds.
    """

    size: float
    axes: tuple[Floats, Floats, Floats]
    vertices: Pairs
    reach: float

    @classmethod
    def of(cls, family: Triangles, emitter: Emitter) -> "LightFrame | None":
        """The frame of a light; None if it has no extent, as boxes are cut along its rays exactly."""
        if not emitter.extent:
            return None
        across, along, normal = unit(emitter.first), unit(emitter.second), emitter.normal
        width, height = lengths(emitter.first).item(), lengths(emitter.second).item()
        # Coordinates that float32 cannot hold, of a mesh around a tiny light, leave no triangle out.
        with np.errstate(invalid="ignore", over="ignore"):
            volume = dot(cross(across, along), normal)
            axes = (
                cross(along, normal) / volume / width,
                cross(normal, across) / volume / height,
                normal / max(width, height),
            )
            corners = [_coordinates(axes, vertex - emitter.centre) for vertex in family.vertices]
            vertices = np.stack([corner.astype(np.float32) for corner in corners])
            reach = np.abs(vertices).max() + _formed(axes, family.sizes.max() + emitter.size)
        return cls(emitter.size, axes, vertices, float(reach))

    def pyramids(self, view: LightView) -> Pairs:
        """Coefficients of `overlapping` per point of a view, (6, n) float32.

        |p_w|, and with the sign of p_w: -p_u and -p_v, half an edge; half an edge times |p_w|; the bound on
        rounding.
        """
        sizes = view.of_points(view.points.sizes) + self.size
        with np.errstate(invalid="ignore", over="ignore"):
            across, along, away = local = _coordinates(self.axes, -view.towards)
            reach = np.abs(local).max(axis=0) + _formed(self.axes, sizes)
            side, depth = np.where(away < 0, -1.0, 1.0), np.abs(away)
            largest = (self.reach + 1) * (reach + 1)
            # Products that float32 cannot hold leave no triangle out.
            rounding = np.where(largest < 2.0**125, FRAME_ERROR * largest, np.inf)
            rows = (depth, -side * across, -side * along, side * HALF_EDGE, depth * HALF_EDGE, rounding)
            return np.stack([row.astype(np.float32) for row in rows])

    def overlapping(self, pyramids: Pairs, points: Integers, triangles: Integers) -> Integers:
        """Pairs (P,) whose triangle may be in the way from the point to some place of the light."""
        depth, across, along, half, half_depth, rounding = np.take(pyramids, points, axis=1, mode="clip")
        least = np.full((2, points.size), np.inf, dtype=np.float32)
        greatest = -least
        with np.errstate(invalid="ignore", over="ignore"):
            for vertex in self.vertices:
                x, y, away = np.take(vertex, triangles, axis=1, mode="clip")
                edge = half_depth - half * away
                for row, (place, by_depth) in enumerate(((x, across), (y, along))):
                    seen = place * depth + by_depth * away
                    np.minimum(least[row], seen - edge, out=least[row])
                    np.maximum(greatest[row], seen + edge, out=greatest[row])
            beyond = (least > rounding) | (greatest < -rounding)
        return np.flatnonzero(~(beyond[0] | beyond[1]))


def _coordinates(axes: tuple[Floats, Floats, Floats], points: Floats) -> Floats:
    return np.stack([dot(axis, points) for axis in axes])


def _formed(axes: tuple[Floats, Floats, Floats], sizes: Floats) -> Floats:
    return FLOAT64_ROUNDING * max(magnitude(axis).item() for axis in axes) * sizes
