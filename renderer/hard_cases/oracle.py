"""Exact answers to what a ray hits: rational numbers for flat shapes, 200 binary digits for ellipsoids.

The numbers of a scene are doubles, and every double is a rational number, so a flat shape's answer has no
error at all. `margin` is how near to the border between hit and miss a ray passes, relative to the shape:
an answer within roundings of the border is a matter of opinion, any other is not.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath

from renderer.hard_cases import flat_oracle
from renderer.hard_cases.answers import Answer
from renderer.hard_cases.exact_vectors import Vector

mpmath.mp.dps = 50

DIGITS = 200
"""Binary digits behind the point of square roots."""


def rounded(vector: Sequence[Any]) -> tuple[float, ...]:
    """The nearest doubles."""
    return tuple(float(c) for c in vector)


def unit(vector: Sequence[Any]) -> tuple[float, ...]:
    """To 50 digits, then rounded once."""
    parts = [mpmath.mpf(c.numerator) / c.denominator if isinstance(c, Fraction) else c for c in vector]
    length = mpmath.sqrt(mpmath.fsum(c * c for c in parts))
    return rounded([c / length for c in parts])


def ellipsoid(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """Nearest root ahead; from inside that is the far one.

    In whole numbers: the shape's numbers and the origin times one power of two, the direction times another,
    places in the frame of the unit sphere times the product of the squared semi-axes.
    """
    (start, middle, *axes), scale = _whole([origin, shape.center, *_semi_axes(shape)])
    (along,), finer = _whole([direction])
    squared = [_product(axis, axis) for axis in axes]
    one = math.prod(squared)
    rows = [[x * (one // length) for x in axis] for axis, length in zip(axes, squared, strict=True)]
    o = [_product(row, [x - y for x, y in zip(start, middle, strict=True)]) for row in rows]
    d = [_product(row, along) for row in rows]
    a, b, c = _product(d, d), _product(o, d), _product(o, o) - one * one
    discriminant = b * b - a * c
    closest = math.sqrt(max(0.0, 1 - discriminant / (a * one * one)))
    largest = max(abs(x) for vector in (start, middle, *axes) for x in vector)
    gap = abs(discriminant) / (a * one * one) / (1 + closest)
    margin = gap * _narrowest_share(axes, along, a, largest)
    above, below = _nearest_ahead(a, b, c, discriminant)
    if above <= 0:
        return Answer(hit=False, margin=margin)
    local = [x * below + above * y for x, y in zip(o, d, strict=True)]
    normal = [sum(x * row[k] for x, row in zip(local, rows, strict=True)) for k in range(3)]
    outside = _product(normal, along) < 0
    return Answer(
        hit=True,
        margin=margin,
        t=above * finer / (below * scale),
        position=tuple((x * below + above * y) / (below * scale) for x, y in zip(start, along, strict=True)),
        normal=unit([Fraction(n if outside else -n) for n in normal]),
        uv=_angles(*(mpmath.mpf(x) for x in local)),
    )


def _narrowest_share(axes: list[list[int]], along: list[int], a: int, largest: int) -> float:
    """Half the least width of the outline that a ray sees, in shares of the largest coordinate.

    The outline's squared semi-axes are the eigenvalues of a 2 x 2 matrix: the smaller one from their product.
    """
    length, one = _product(along, along), math.prod(_product(axis, axis) for axis in axes)
    trace = sum(_product(axis, axis) * length - _product(axis, along) ** 2 for axis in axes)
    likeness = 4 * a * length / (one * trace * trace)
    least = 2 * a / (one * trace * largest * largest)
    return math.sqrt(least / (1 + math.sqrt(max(0.0, 1 - likeness))))


def _semi_axes(shape: Any) -> list[Vector]:
    r = getattr(shape, "radius", 0.0)
    return list(getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r))))


def _whole(vectors: Sequence[Vector]) -> tuple[list[list[int]], int]:
    """Doubles times the least power of two that makes all of them whole, and that power."""
    ratios = [[float(x).as_integer_ratio() for x in vector] for vector in vectors]
    scale = max(below for vector in ratios for _, below in vector)
    return [[above * (scale // below) for above, below in vector] for vector in ratios], scale


def _product(a: Sequence[int], b: Sequence[int]) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


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


def _angles(x: Any, y: Any, z: Any) -> tuple[float, float]:
    longitude = mpmath.atan2(y, x) / (2 * mpmath.pi)
    return float(longitude % 1), float(mpmath.atan2(mpmath.hypot(x, y), -z) / mpmath.pi)


def _mp(x: Fraction) -> Any:
    return mpmath.mpf(x.numerator) / mpmath.mpf(x.denominator)


ANSWERS = {"triangle": flat_oracle.triangle, "rectangle": flat_oracle.rectangle, "ellipsoid": ellipsoid}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """What one ray meets on one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
