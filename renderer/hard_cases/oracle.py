"""Exact answers to what a ray hits: rational numbers for flat shapes, 200 binary digits for ellipsoids.

The numbers of a scene are doubles, and every double is a rational number, so a flat shape's answer has no
error at all. `margin` is how near to the border between hit and miss a ray passes, relative to the shape:
an answer within roundings of the border is a matter of opinion, any other is not.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath

Vector = Sequence[float]
Exact = tuple[Fraction, Fraction, Fraction]
mpmath.mp.dps = 50

DIGITS = 200
"""Binary digits behind the point of square roots."""


@dataclass(frozen=True)
class Answer:
    """What a ray meets.

    Attributes
    ----------
    hit : bool
    margin : float
        Distance of the ray from the border line of the shape, in shares of the largest coordinate. For an
        ellipsoid, at most the distance of its closest approach from the surface.
    t : float
        In units of the direction; inf for a miss.
    position, normal : tuple of float
        The normal is on the side the ray comes from. Empty for a miss.
    uv : tuple of float
    """

    hit: bool
    margin: float
    t: float = math.inf
    position: tuple[float, ...] = ()
    normal: tuple[float, ...] = ()
    uv: tuple[float, ...] = ()


def exact(vector: Vector) -> Exact:
    """The rational numbers that three doubles are."""
    x, y, z = (Fraction(float(c)) for c in vector)
    return x, y, z


def minus(a: Exact, b: Exact) -> Exact:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(a: Exact, s: Fraction) -> Exact:
    """The multiple."""
    return a[0] * s, a[1] * s, a[2] * s


def plus(a: Exact, b: Exact) -> Exact:
    """The sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def cross(a: Exact, b: Exact) -> Exact:
    """The cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Exact, b: Exact) -> Fraction:
    """The dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def rounded(vector: Sequence[Any]) -> tuple[float, ...]:
    """The nearest doubles."""
    return tuple(float(c) for c in vector)


def unit(vector: Sequence[Any]) -> tuple[float, ...]:
    """To 50 digits, then rounded once."""
    parts = [mpmath.mpf(c.numerator) / c.denominator if isinstance(c, Fraction) else c for c in vector]
    length = mpmath.sqrt(mpmath.fsum(c * c for c in parts))
    return rounded([c / length for c in parts])


def triangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """The nearest hit of a triangle."""
    a, b, c = vertices = [exact(vertex) for vertex in shape.vertices]
    margin = _margin(vertices, exact(origin), exact(direction))
    found = _plane(a, minus(b, a), minus(c, a), origin, direction)
    if found is None:
        return Answer(hit=False, margin=margin)
    t, place, u, v, normal = found
    if min(u, v, 1 - u - v) < 0 or t <= 0:
        return Answer(hit=False, margin=margin)
    uvs = shape.uvs or ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    uv = [sum(w * Fraction(x[k]) for w, x in zip((1 - u - v, u, v), uvs, strict=True)) for k in (0, 1)]
    return Answer(True, margin, float(t), rounded(place), unit(normal), rounded(uv))


def rectangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """The form with a corner and edges."""
    corner, (first, second) = exact(shape.corner), (exact(edge) for edge in shape.edges)
    corners = [corner, plus(corner, first), plus(plus(corner, first), second), plus(corner, second)]
    margin = _margin(corners, exact(origin), exact(direction))
    found = _plane(corner, first, second, origin, direction)
    if found is None:
        return Answer(hit=False, margin=margin)
    t, place, u, v, normal = found
    if min(u, v, 1 - u, 1 - v) < 0 or t <= 0:
        return Answer(hit=False, margin=margin)
    return Answer(True, margin, float(t), rounded(place), unit(normal), (float(u), float(v)))


def _margin(corners: Sequence[Exact], origin: Exact, direction: Exact) -> float:
    """Least distance of the ray's line from the border's lines, in shares of the largest coordinate."""
    largest = max(abs(x) for place in (*corners, origin) for x in place)
    distances = []
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        across, away = cross(direction, minus(end, start)), minus(start, origin)
        if not any(across):
            beside = cross(direction, away)
            distances.append(_mp(dot(beside, beside) / dot(direction, direction)))
        else:
            distances.append(_mp(dot(away, across) ** 2 / dot(across, across)))
    return float(mpmath.sqrt(min(distances)) / _mp(largest))


def _plane(
    corner: Exact, first: Exact, second: Exact, origin: Vector, direction: Vector
) -> tuple[Fraction, Exact, Fraction, Fraction, Exact] | None:
    o, d = exact(origin), exact(direction)
    normal = cross(first, second)
    slope = dot(normal, d)
    if slope == 0:
        return None
    t = dot(normal, minus(corner, o)) / slope
    place = plus(o, times(d, t))
    away, area = minus(place, corner), dot(normal, normal)
    u, v = dot(cross(away, second), normal) / area, dot(cross(first, away), normal) / area
    return t, place, u, v, normal if slope < 0 else times(normal, Fraction(-1))


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
    margin = gap * (math.isqrt(min(squared) << 2 * DIGITS) / (largest << DIGITS))
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


ANSWERS = {"triangle": triangle, "rectangle": rectangle, "ellipsoid": ellipsoid}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """What one ray meets on one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
