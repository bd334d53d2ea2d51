"""Three-dimensional vectors as plain tuples, for the few checks that a scene needs before it is compiled.

Every function divides by the largest component first, so that neither 1e-300 nor 1e300 loses a square.
"""

from __future__ import annotations

import math

Vector = tuple[float, float, float]

PARALLEL = 1e-9
"""Two vectors whose angle has a smaller sine than this are taken as parallel. Dimensionless."""


def scaled(a: Vector) -> Vector:
    """Divide a non-zero vector by its largest component; the zero vector stays."""
    largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
    if largest == 0:
        return a
    return a[0] / largest, a[1] / largest, a[2] / largest


def length(a: Vector) -> float:
    """Euclidean length, without overflow or underflow of the squares."""
    return math.hypot(*a)


def difference(a: Vector, b: Vector) -> Vector:
    """Give a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def add(a: Vector, b: Vector) -> Vector:
    """Give a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(factor: float, a: Vector) -> Vector:
    """Give factor * a."""
    return factor * a[0], factor * a[1], factor * a[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Give the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> float:
    """Give the scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def sine_between(a: Vector, b: Vector) -> float:
    """Sine of the angle between two non-zero vectors, 0 to 1; 0 where one of them is zero."""
    a, b = scaled(a), scaled(b)
    lengths = length(a) * length(b)
    return length(cross(a, b)) / lengths if lengths else 0.0


def cosine_between(a: Vector, b: Vector) -> float:
    """Cosine of the angle between two non-zero vectors, -1 to 1; 0 where one of them is zero."""
    a, b = scaled(a), scaled(b)
    lengths = length(a) * length(b)
    return dot(a, b) / lengths if lengths else 0.0


def parallel(a: Vector, b: Vector) -> bool:
    """Whether two vectors span no area, up to `PARALLEL`."""
    return sine_between(a, b) <= PARALLEL
