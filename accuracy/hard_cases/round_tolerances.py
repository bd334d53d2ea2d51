"""How far rounding may move the answer about a ray and an ellipsoid.

With s the largest number of ray and shape and c the cosine between ray and normal, places are uncertain by
some eps s, along the ray by that over c. What follows for normals and texture coordinates depends on the
curvature.
"""

import math
from typing import Any

import numpy as np

from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.scoring import Found, Tolerance
from renderer.math.arrays import Floats

ROUNDINGS = 8
"""Roundings of the largest number that a place may be off by."""
MORE_ROUNDINGS = 16
"""Those of normals and texture coordinates at a place that is known."""
EPS = float(np.finfo(np.float64).eps)


def semi_axes(shape: Any) -> Floats:
    """Semi-axes of a shape of the scene language, one a row."""
    return np.array(shape.axes) if hasattr(shape, "axes") else np.eye(3) * shape.radius


def along_the_ray(roundings: float, dtype: type[np.floating]) -> Tolerance:
    """Error of t: so many roundings of the largest number, over c."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        rounding = float(np.finfo(dtype).eps) * _scale(shape, origin)
        return roundings * rounding / _cosine(true, direction) / math.hypot(*direction)

    return Tolerance(dtype, allowed)


def of_the_axes(roundings: float, dtype: type[np.floating]) -> Tolerance:
    """Error of t: so many roundings of the longest semi-axis, over c."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del origin
        rounding = float(np.finfo(dtype).eps) * float(np.linalg.norm(semi_axes(shape), axis=1).max())
        return roundings * rounding / _cosine(true, direction) / math.hypot(*direction)

    return Tolerance(dtype, allowed)


def details(shape: Any, true: Answer, found: Found) -> float:
    """Error of place, normal and texture coordinates, in shares of what is right.

    The place may be off by 8 eps s across the surface and by that over c along it. From one end of the
    longitude to the other is no distance.
    """
    place, step = _uncertain(shape, true, found.origin, found.direction, EPS)
    _, slide = _steepness(shape, true.normal)
    off = found.position - np.array(true.position)
    across, along = np.abs(found.uv - true.uv)
    mapped = (MORE_ROUNDINGS * EPS + step * slide) / math.sin(math.pi * true.uv[1])
    errors = {
        abs(float(np.dot(off, true.normal))) / place,
        float(np.linalg.norm(off)) / step,
        angle(found.normal, true.normal) / turned(shape, true, found.origin, found.direction, EPS),
        2 * math.pi * min(across, 1 - across) / mapped,
        math.pi * along / mapped,
    }
    return float(max(errors))


def turned(shape: Any, true: Answer, origin: Floats, direction: Floats, eps: float) -> float:
    """Angle that the normal may be off by, radians: 16 eps, and what the place's uncertainty turns it by."""
    _, step = _uncertain(shape, true, origin, direction, eps)
    turn, _ = _steepness(shape, true.normal)
    return MORE_ROUNDINGS * eps + step * turn


def _uncertain(
    shape: Any, true: Answer, origin: Floats, direction: Floats, eps: float
) -> tuple[float, float]:
    """How far a place may be off across the surface, and along the ray."""
    across = ROUNDINGS * eps * _scale(shape, origin)
    return across, across / _cosine(true, direction)


def _steepness(shape: Any, normal: Any) -> tuple[float, float]:
    """How far a step along the surface turns the normal, and how far it goes on the unit sphere.

    With A the matrix of semi-axes and N = A^-T u the normal at the place u of the unit sphere, that is at
    most |A^-1 P|^2 / |N| and |A^-1 P| of its length, P the projection on the tangent plane.
    """
    axes = semi_axes(shape)
    rows = axes / (axes * axes).sum(axis=1)[:, None]
    flat = float(np.linalg.norm(rows - np.outer(rows @ normal, normal)))
    return flat * flat * float(np.linalg.norm(axes @ normal)), flat


def angle(a: Floats, b: Any) -> float:
    """Between unit vectors, radians; small ones keep their digits."""
    return 2 * math.asin(min(1.0, float(np.linalg.norm(np.subtract(a, b))) / 2))


def _scale(shape: Any, origin: Floats) -> float:
    return float(max(np.abs(part).max() for part in (origin, np.array(shape.center), semi_axes(shape))))


def _cosine(true: Answer, direction: Floats) -> float:
    return abs(float(np.dot(true.normal, direction))) / math.hypot(*direction)
