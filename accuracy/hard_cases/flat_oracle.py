"""Exact answers to what a ray hits, for flat shapes: in whole numbers, rounded once at the end."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.exact_vectors import Triple, Vector, cross, dot, minus, plus, times, unit, whole


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
    if plane is None or not 0 <= plane.u <= plane.slope or not 0 <= plane.v <= plane.slope:
        return Answer(hit=False, margin=margin)
    if plane.height <= 0:
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
    """Where a line meets the plane of a flat shape: u, v and height are those of the place times `slope` > 0.

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
