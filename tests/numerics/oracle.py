"""Exact answers to what a ray hits: whole numbers for flat shapes, 200 binary digits for ellipsoids."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, TypeVar

from tests.numerics.tracing import mp


@dataclass(frozen=True)
class Answer:
    """What a ray hits.

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


Vector = Sequence[float]
Number = TypeVar("Number", int, Fraction)
Triple = tuple[Number, Number, Number]


def rational(vector: Vector) -> Triple[Fraction]:
    """The rational numbers that three doubles are."""
    x, y, z = (Fraction(float(c)) for c in vector)
    return x, y, z


def minus(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(a: Triple[Number], s: Number) -> Triple[Number]:
    return a[0] * s, a[1] * s, a[2] * s


def plus(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def cross(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Triple[Number], b: Triple[Number]) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a: Triple[Number]) -> tuple[float, ...]:
    """Of length 1, each component within a rounding."""
    square = dot(a, a)
    return tuple(math.sqrt(x * x / square) * (1 if x > 0 else -1) for x in a)


def whole(vectors: Sequence[Vector]) -> tuple[list[Triple[int]], int]:
    """Doubles times the least power of two that makes all of them whole numbers, and that power."""
    ratios = [[float(x).as_integer_ratio() for x in vector] for vector in vectors]
    scale = max(below for vector in ratios for _, below in vector)
    return [_triple(above * (scale // below) for above, below in vector) for vector in ratios], scale


def _triple(parts: Iterable[int]) -> Triple[int]:
    x, y, z = parts
    return x, y, z


def triangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """The nearest hit of a triangle."""
    vertices, line = _in_whole_numbers(shape.vertices, origin, direction)
    a, b, c = vertices
    plane = _plane(a, minus(b, a), minus(c, a), line)
    margin = _margin(vertices, line)
    if plane is None or min(plane.u, plane.v, plane.slope - plane.u - plane.v) < 0 or plane.height <= 0:
        return Answer(hit=False, margin=margin)
    uvs = shape.uvs or ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    weights = [Fraction(part, plane.slope) for part in (plane.slope - plane.u - plane.v, plane.u, plane.v)]
    uv = [sum(w * Fraction(x[k]) for w, x in zip(weights, uvs, strict=True)) for k in (0, 1)]
    return Answer(True, margin, *plane.hit(line), (float(uv[0]), float(uv[1])))


def rectangle(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """The form with a corner and edges."""
    (corner, first, second), line = _in_whole_numbers((shape.corner, *shape.edges), origin, direction)
    corners = [corner, plus(corner, first), plus(plus(corner, first), second), plus(corner, second)]
    plane = _plane(corner, first, second, line)
    margin = _margin(corners, line)
    if plane is None or max(plane.u, plane.v) > plane.slope or min(plane.u, plane.v) < 0 or plane.height <= 0:
        return Answer(hit=False, margin=margin)
    return Answer(True, margin, *plane.hit(line), (plane.u / plane.slope, plane.v / plane.slope))


@dataclass(frozen=True, slots=True)
class _Line:
    """A ray in whole numbers: its origin times `unit`, its direction times `along_unit`."""

    origin: Triple[int]
    direction: Triple[int]
    unit: int
    along_unit: int


@dataclass(frozen=True, slots=True)
class _Plane:
    """Where a line hits the plane of a flat shape: u, v and height are those of the place times `slope` > 0.

    The normal is on the side that the line comes from. Quotients of whole numbers are rounded once.
    """

    u: int
    v: int
    height: int
    slope: int
    normal: Triple[int]

    def hit(self, line: _Line) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
        """Distance, place and unit normal, each number within a rounding."""
        t = self.height * line.along_unit / (self.slope * line.unit)
        place = plus(times(line.origin, self.slope), times(line.direction, self.height))
        return t, tuple(x / (self.slope * line.unit) for x in place), unit(self.normal)


def _plane(corner: Triple[int], first: Triple[int], second: Triple[int], line: _Line) -> _Plane | None:
    normal = cross(first, second)
    slope = -dot(normal, line.direction)
    if slope == 0:
        return None
    if slope < 0:
        found = _plane(corner, second, first, line)
        return found and _Plane(found.v, found.u, found.height, found.slope, found.normal)
    away = minus(line.origin, corner)
    moment = cross(away, line.direction)
    return _Plane(dot(moment, second), -dot(moment, first), dot(normal, away), slope, normal)


def _margin(corners: Sequence[Triple[int]], line: _Line) -> float:
    """Least distance of the ray's line from the border's lines, in shares of the largest coordinate."""
    largest = max(abs(x) for place in (*corners, line.origin) for x in place)
    squares = []
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        across, away = cross(line.direction, minus(end, start)), minus(start, line.origin)
        if not any(across):
            beside = cross(line.direction, away)
            squares.append(dot(beside, beside) / (dot(line.direction, line.direction) * largest**2))
        else:
            squares.append(dot(away, across) ** 2 / (dot(across, across) * largest**2))
    return math.sqrt(min(squares))


def _in_whole_numbers(
    places: Sequence[Vector], origin: Vector, direction: Vector
) -> tuple[list[Triple[int]], _Line]:
    (*shape, start), unit = whole((*places, origin))
    (along,), along_unit = whole((direction,))
    return shape, _Line(start, along, unit, along_unit)


BITS = 200
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
    one = 1 << BITS
    root = math.isqrt(discriminant << 2 * BITS)
    far = -(b * one + root) if b > 0 else -b * one + root
    roots = [(far, a * one), (c * one, far)] if far else [(0, 1)]
    ahead = [(above, below) if below > 0 else (-above, -below) for above, below in roots]
    return min((r for r in ahead if r[0] > 0), key=lambda r: Fraction(*r), default=(0, 1))


def _angles(local: Triple[int]) -> tuple[float, float]:
    x, y, z = (mp.mpf(part) for part in local)
    longitude = mp.atan2(y, x) / (2 * mp.pi)
    return float(longitude % 1), float(mp.atan2(mp.hypot(x, y), -z) / mp.pi)


ANSWERS = {"triangle": triangle, "rectangle": rectangle, "ellipsoid": ellipsoid}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """What one ray hits of one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
