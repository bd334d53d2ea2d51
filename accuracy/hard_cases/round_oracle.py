"""Exact answers to what a ray hits, for ellipsoids: in whole numbers, roots to 200 binary digits."""

import math
from fractions import Fraction
from typing import Any

import mpmath

from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.exact_vectors import Triple, Vector, dot, minus, plus, times, unit, whole

DIGITS = 200
"""Binary digits behind the point of square roots."""


def ellipsoid(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """Nearest root ahead; from inside that is the far one.

    In whole numbers: the shape's numbers and the origin times one power of two, the direction times another,
    places in the frame of the unit sphere times the product of the squared semi-axes.
    """
    (start, middle, *axes), scale = whole([origin, shape.center, *_semi_axes(shape)])
    (along,), finer = whole([direction])
    squared = [dot(axis, axis) for axis in axes]
    one = math.prod(squared)
    rows = [times(axis, one // length) for axis, length in zip(axes, squared, strict=True)]
    o, d = _through(rows, minus(start, middle)), _through(rows, along)
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - one * one
    discriminant = b * b - a * c
    closest = math.sqrt(max(0.0, 1 - discriminant / (a * one * one)))
    largest = max(abs(x) for vector in (start, middle, *axes) for x in vector)
    gap = abs(discriminant) / (a * one * one) / (1 + closest)
    margin = gap * _narrowest_share(axes, along, a, largest)
    above, below = _nearest_ahead(a, b, c, discriminant)
    if above <= 0:
        return Answer(hit=False, margin=margin)
    local = plus(times(o, below), times(d, above))
    place = plus(times(start, below), times(along, above))
    normal = plus(plus(times(rows[0], local[0]), times(rows[1], local[1])), times(rows[2], local[2]))
    return Answer(
        hit=True,
        margin=margin,
        t=above * finer / (below * scale),
        position=tuple(x / (below * scale) for x in place),
        normal=unit(normal if dot(normal, along) < 0 else times(normal, -1)),
        uv=_angles(local),
    )


def _narrowest_share(axes: list[Triple[int]], along: Triple[int], a: int, largest: int) -> float:
    """Half the least width of the outline that a ray sees, in shares of the largest coordinate.

    The outline's squared semi-axes are the eigenvalues of a 2 x 2 matrix: the smaller one from their product.
    """
    length, one = dot(along, along), math.prod(dot(axis, axis) for axis in axes)
    trace = sum(dot(axis, axis) * length - dot(axis, along) ** 2 for axis in axes)
    likeness = 4 * a * length / (one * trace * trace)
    least = 2 * a / (one * trace * largest * largest)
    return math.sqrt(least / (1 + math.sqrt(max(0.0, 1 - likeness))))


def _semi_axes(shape: Any) -> list[Vector]:
    r = getattr(shape, "radius", 0.0)
    return list(getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r))))


def _through(rows: list[Triple[int]], vector: Triple[int]) -> Triple[int]:
    return dot(rows[0], vector), dot(rows[1], vector), dot(rows[2], vector)


def _nearest_ahead(a: int, b: int, c: int, discriminant: int) -> tuple[int, int]:
    """The least positive root of a t^2 + 2 b t + c as a quotient of whole numbers, 0 / 1 if there is none."""
    if discriminant < 0:
        return 0, 1
    one = 1 << DIGITS
    root = math.isqrt(discriminant << 2 * DIGITS)
    far = -(b * one + root) if b > 0 else -b * one + root
    roots = [(far, a * one), (c * one, far)] if far else [(0, 1)]
    ahead = [(above, below) if below > 0 else (-above, -below) for above, below in roots]
    return min((r for r in ahead if r[0] > 0), key=lambda r: Fraction(*r), default=(0, 1))


def _angles(local: Triple[int]) -> tuple[float, float]:
    x, y, z = (mpmath.mpf(part) for part in local)
    longitude = mpmath.atan2(y, x) / (2 * mpmath.pi)
    return float(longitude % 1), float(mpmath.atan2(mpmath.hypot(x, y), -z) / mpmath.pi)
