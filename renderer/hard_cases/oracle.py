"""Exact answers to what a ray hits: rational numbers for flat shapes, 50 digits for ellipsoids.

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
    """Nearest root ahead; from inside that is the far one."""
    r = getattr(shape, "radius", 0.0)
    axes = getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r)))
    exact_axes = [exact(axis) for axis in axes]
    relative, along = minus(exact(origin), exact(shape.center)), exact(direction)
    o, d = _local(relative, exact_axes), _local(along, exact_axes)
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - 1
    discriminant = b * b - a * c
    closest = mpmath.sqrt(_mp((dot(o, o) * a - b * b) / a))
    shortest = mpmath.sqrt(min(_mp(dot(axis, axis)) for axis in exact_axes))
    largest = max(abs(x) for vector in (exact(origin), exact(shape.center), *exact_axes) for x in vector)
    margin = float(abs(1 - closest) * shortest / _mp(largest))
    if discriminant < 0:
        return Answer(hit=False, margin=margin)
    root = mpmath.sqrt(_mp(discriminant))
    ahead = [t for t in ((-_mp(b) - root) / _mp(a), (-_mp(b) + root) / _mp(a)) if t > 0]
    if not ahead:
        return Answer(hit=False, margin=margin)
    t = ahead[0]
    local = [_mp(x) + t * _mp(y) for x, y in zip(o, d, strict=True)]
    place = [
        _mp(Fraction(float(x))) + t * _mp(Fraction(float(y))) for x, y in zip(origin, direction, strict=True)
    ]
    normal = [
        mpmath.fsum(
            x * _mp(axis[k]) / _mp(dot(axis, axis)) for x, axis in zip(local, exact_axes, strict=True)
        )
        for k in range(3)
    ]
    outside = mpmath.fsum(n * _mp(y) for n, y in zip(normal, along, strict=True)) < 0
    longitude = mpmath.atan2(local[1], local[0]) / (2 * mpmath.pi)
    latitude = mpmath.atan2(mpmath.hypot(local[0], local[1]), -local[2]) / mpmath.pi
    return Answer(
        hit=True,
        margin=margin,
        t=float(t),
        position=rounded(place),
        normal=unit(normal if outside else [-n for n in normal]),
        uv=(float(longitude % 1), float(latitude)),
    )


def _local(vector: Exact, axes: Sequence[Exact]) -> Exact:
    x, y, z = (dot(vector, axis) / dot(axis, axis) for axis in axes)
    return x, y, z


def _mp(x: Fraction) -> Any:
    return mpmath.mpf(x.numerator) / mpmath.mpf(x.denominator)


ANSWERS = {"triangle": triangle, "rectangle": rectangle, "ellipsoid": ellipsoid}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """What one ray meets on one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
