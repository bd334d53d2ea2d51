"""Vectors of rational or whole numbers, and doubles as such."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import TypeVar

Vector = Sequence[float]
Number = TypeVar("Number", int, Fraction)
Triple = tuple[Number, Number, Number]


def exact(vector: Vector) -> Triple[Fraction]:
    """The rational numbers that three doubles are."""
    x, y, z = (Fraction(float(c)) for c in vector)
    return x, y, z


def minus(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(a: Triple[Number], s: Number) -> Triple[Number]:
    """The multiple."""
    return a[0] * s, a[1] * s, a[2] * s


def plus(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    """The sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def cross(a: Triple[Number], b: Triple[Number]) -> Triple[Number]:
    """The cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Triple[Number], b: Triple[Number]) -> Number:
    """The dot product."""
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
