"""Nodes of a tree that may stand between points and a light."""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import Level, Visits
from renderer.math.arrays import Floats, Masks
from renderer.math.numerics import gamma


@dataclass(frozen=True, slots=True, eq=False)
class Shafts:
    """All segments from each of N points to anywhere on a light.

    Attributes
    ----------
    points : (3, N) float64
    low, high : (3, N) float64
        Bounds of the light minus point, or bounds of the direction to a light at infinity.
    endless : bool
        Whether the light is at infinity.
    normals : (3, N) float64
        Geometry below the plane through the point with this normal cannot occlude it.
    slack : (N,) float64
        Below it by more than that.
    """

    points: Floats
    low: Floats
    high: Floats
    endless: bool
    normals: Floats
    slack: Floats


Slopes = tuple[Floats, Floats, Floats]
"""Reciprocal slopes and offset that turn s * reach >= x into bounds on s, (3, N) each."""


def visits_of_shafts(levels: tuple[Level, ...], shafts: Shafts, start: Visits) -> Visits:
    """Nodes below the given levels that may lie between points and a light.

    A place on a segment is p + s (q - p), 0 <= s <= 1: on every axis between p + s (low - p) and
    p + s (high - p). A box is left out if no single s brings these bounds into it on all three axes, or if
    it is below the horizon. For a light at infinity q - p is the direction itself and s has no end.
    """
    visits = start
    rising, falling = _slopes(shafts.high), _slopes(-shafts.low)
    with np.errstate(invalid="ignore", over="ignore"):
        for level in levels:
            visits = level.below(visits, _between(level, visits, shafts, rising, falling))
    return visits


def _slopes(reach: Floats) -> Slopes:
    """Slopes for a reach (3, N).

    Slope 0 gives a least s of 0 where reach is not positive, and no greatest s where it is not negative.
    """
    with np.errstate(divide="ignore"):
        inverse = 1 / reach
    least = np.where(reach > 0, inverse, 0.0)
    greatest = np.where(reach < 0, inverse, 0.0)
    return least, greatest, np.where(reach < 0, 0.0, np.inf)


def _between(level: Level, visits: Visits, shafts: Shafts, rising: Slopes, falling: Slopes) -> Masks:
    rays, shape = visits.rays, (level.children, visits.rays.size)
    first, height = np.zeros(shape), np.zeros(shape)
    last = np.full(shape, np.inf if shafts.endless else 1.0)
    ahead, behind, spare, other = (np.empty(shape) for _ in range(4))
    for axis in range(3):
        point, normal = (np.take(values[axis], rays) for values in (shafts.points, shafts.normals))
        np.take(level.sides[axis], visits.nodes, axis=1, out=ahead, mode="clip")
        np.subtract(ahead, point, out=ahead)
        np.take(level.sides[axis], visits.nodes + level.nodes, axis=1, out=behind, mode="clip")
        np.subtract(point, behind, out=behind)
        np.multiply(ahead, normal, out=spare)
        np.maximum(spare, np.multiply(behind, -normal, out=other), out=spare)
        np.add(height, spare, out=height)
        # s * (light.high - p) >= box.low - p, and s * (p - light.low) >= p - box.high
        for side, slopes in ((ahead, rising), (behind, falling)):
            least, greatest, beyond = (np.take(values[axis], rays) for values in slopes)
            # Slopes of one kind are mostly 0 for all points, which then bound nothing.
            if least.any():
                np.maximum(first, np.multiply(side, least, out=spare), out=first)
            if greatest.any():
                np.add(np.multiply(side, greatest, out=spare), beyond, out=spare)
                np.minimum(last, spare, out=last)
    last *= 1 + 2 * gamma(3)
    last += 2 * gamma(3)
    return (first <= last) & (height >= -shafts.slack[rays])
