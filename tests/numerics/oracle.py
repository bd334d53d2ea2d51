"""Exact answers to what a ray hits: rational numbers for flat shapes, roots of 100 digits for ellipsoids."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath

Vector = Sequence[Any]
"""Three numbers: doubles, or rational numbers."""
Exact = tuple[Fraction, Fraction, Fraction]

mp = mpmath.MPContext()
mp.dps = 100


@dataclass(frozen=True)
class Answer:
    """The hit of a ray.

    Attributes
    ----------
    hit : bool
    margin : float
        Distance of the ray from the border line of the shape, in shares of the largest coordinate. For an
        ellipsoid, at most its distance from the outline that the ray sees.
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


def rational(vector: Vector) -> Exact:
    """The rational numbers that three doubles are."""
    x, y, z = (Fraction(float(c)) for c in vector)
    return x, y, z


def minus(a: Vector, b: Vector) -> Exact:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def along(a: Vector, b: Vector, s: Any) -> Exact:
    """The place a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


def cross(a: Vector, b: Vector) -> Exact:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> Fraction:
    result: Fraction = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def unit(a: Vector) -> tuple[float, ...]:
    """Of length 1, each component within a rounding."""
    square = dot(a, a)
    return tuple(math.sqrt(x * x / square) * (1 if x > 0 else -1) for x in a)


def triangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    a, b, c = (rational(vertex) for vertex in shape.vertices)
    return _flat((a, b, c), minus(b, a), minus(c, a), rational(origin), rational(direction), shape.uvs)


def rectangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """The form with a corner and edges."""
    corner, first, second = (rational(part) for part in (shape.corner, *shape.edges))
    ends = along(corner, first, 1), along(along(corner, first, 1), second, 1), along(corner, second, 1)
    return _flat((corner, *ends), first, second, rational(origin), rational(direction))


def _flat(
    corners: Sequence[Exact], first: Exact, second: Exact, origin: Exact, direction: Exact, uvs: Any = None
) -> Answer:
    """Cramer's rule for corner + u first + v second = origin + t direction."""
    margin = _margin(corners, origin, direction)
    normal = cross(first, second)
    slope = dot(normal, direction)
    if slope == 0:
        return Answer(hit=False, margin=margin)
    away = minus(origin, corners[0])
    moment = cross(away, direction)
    t, u, v = -dot(normal, away) / slope, -dot(moment, second) / slope, dot(moment, first) / slope
    outside = u + v > 1 if len(corners) == 3 else max(u, v) > 1
    if outside or min(u, v) < 0 or t <= 0:
        return Answer(hit=False, margin=margin)
    texture = u, v
    if uvs:
        a, b, c = ([Fraction(float(x)) for x in uv] for uv in uvs)
        texture = tuple(a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) for k in (0, 1))
    place = tuple(float(x) for x in along(origin, direction, t))
    facing = normal if slope < 0 else minus((0, 0, 0), normal)
    return Answer(True, margin, float(t), place, unit(facing), tuple(float(x) for x in texture))


def _margin(corners: Sequence[Exact], origin: Exact, direction: Exact) -> float:
    """Least distance of the ray's line from the border's lines, in shares of the largest coordinate."""
    largest = max(abs(x) for place in (*corners, origin) for x in place)
    squares = []
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        across, away = cross(direction, minus(end, start)), minus(start, origin)
        if any(across):
            squares.append(dot(away, across) ** 2 / dot(across, across))
        else:
            beside = cross(direction, away)
            squares.append(dot(beside, beside) / dot(direction, direction))
    return math.sqrt(min(squares) / largest**2)


def ellipsoid(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """Nearest root ahead of |o + t d| = 1 in the frame of the unit sphere; from inside the far one."""
    start, middle, way = rational(origin), rational(shape.center), rational(direction)
    axes = [rational(axis) for axis in _semi_axes(shape)]

    def local(vector: Exact) -> Exact:
        x, y, z = (dot(vector, axis) / dot(axis, axis) for axis in axes)
        return x, y, z

    o, d = local(minus(start, middle)), local(way)
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - 1
    square = b * b - a * c
    largest = max(abs(x) for vector in (start, middle, *axes) for x in vector)
    gap = abs(square) / a / Fraction(1 + math.sqrt(max(0, 1 - square / a)))
    margin = float(gap) * _narrowest_share(axes, way, a, largest)
    t = _nearest_ahead(a, b, c, square)
    if t is None:
        return Answer(hit=False, margin=margin)
    place, hit = along(start, way, t), along(o, d, t)
    normal = (Fraction(0),) * 3
    for x, axis in zip(hit, axes, strict=True):
        normal = along(normal, axis, x / dot(axis, axis))
    facing = normal if dot(normal, way) < 0 else minus((0, 0, 0), normal)
    x, y, z = (_digits(part) for part in hit)
    uv = float(mp.atan2(y, x) / (2 * mp.pi) % 1), float(mp.atan2(mp.hypot(x, y), -z) / mp.pi)
    return Answer(True, margin, float(t), tuple(float(x) for x in place), unit(facing), uv)


def _semi_axes(shape: Any) -> Sequence[Vector]:
    r = getattr(shape, "radius", 0.0)
    axes: Sequence[Vector] = getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r)))
    return axes


def _digits(number: Fraction) -> Any:
    return mp.mpf(number.numerator) / number.denominator


def _nearest_ahead(a: Fraction, b: Fraction, c: Fraction, square: Fraction) -> Fraction | None:
    """The least positive root of a t^2 + 2 b t + c; of a root's digits the first 100 are kept."""
    if square < 0:
        return None
    root = Fraction(str(mp.sqrt(_digits(square))))
    far = -(b + root) if b > 0 else root - b
    return min((t for t in (far / a, c / far if far else Fraction(0)) if t > 0), default=None)


def _narrowest_share(axes: Sequence[Exact], way: Exact, a: Fraction, largest: Fraction) -> float:
    """Half the least width of the outline that a ray sees, in shares of the largest coordinate.

    The outline's squared semi-axes are the eigenvalues of a 2 x 2 matrix: the smaller one from their product.
    """
    length = dot(way, way)
    squared = [dot(axis, axis) for axis in axes]
    one = math.prod(squared)
    trace = sum(square * length - dot(axis, way) ** 2 for square, axis in zip(squared, axes, strict=True))
    least = 2 * a * one / (trace * largest * largest)
    return math.sqrt(least / Fraction(1 + math.sqrt(max(0, 1 - 4 * a * one * length / (trace * trace)))))


ANSWERS = {"triangle": triangle, "rectangle": rectangle, "ellipsoid": ellipsoid}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """Hit of one ray with one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
