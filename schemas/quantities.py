"""Numbers and vectors of the scene language: strict, finite, bounded, each with its unit.

Coordinates stay below 1e15, so that squares and cubes of them are finite in float64. Sizes stay above
1e-100, so that squares of them do not vanish. Functions of vectors divide by the largest component first, so
that neither 1e-300 nor 1e300 loses a square.
"""

from __future__ import annotations

import math
from numbers import Integral
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]

PARALLEL_SINE = 1e-9
"""Vectors are parallel if the sine of their angle is at most this. Dimensionless."""


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
    """Whether two vectors span no area, up to `PARALLEL_SINE`."""
    return sine_between(a, b) <= PARALLEL_SINE


MAX_COORDINATE = 1e15
"""Largest coordinate and size, scene units."""

MIN_SIZE = 1e-100
"""Smallest size, radius and edge, scene units."""

MAX_INTENSITY = 1e30
"""Largest colour component and coefficient."""

MAX_ORIGIN = 1e30
"""Largest coordinate of a ray's origin, scene units: doubles beyond it are as far apart as shapes."""

SHORTEST, LONGEST = 1e-200, 1e200
"""Bounds of the largest component of a ray's direction: in units of it, t is neither 0 nor infinite."""


def whole(number: object) -> object:
    """Read 32.0 as 32, for JSON has one kind of number; other numbers stay as they are.

    Integers of NumPy become those of Python: a strict `int` takes no others.
    """
    # Meshes have a million of them, so what most are comes first.
    if type(number) is int or isinstance(number, bool):
        return number
    is_whole = number.is_integer() if isinstance(number, float) else isinstance(number, Integral)
    return int(number) if is_whole else number  # type: ignore[call-overload]


def _not_zero(vector: Vector) -> Vector:
    if not any(vector):
        raise PydanticCustomError(
            "zero_vector",
            "This vector is zero and has no direction. Make one of its components other than 0.",
        )
    return vector


def _long_enough(vector: Vector) -> Vector:
    if length(vector) < MIN_SIZE:
        raise PydanticCustomError(
            "no_length",
            "This vector is zero or shorter than 1e-100. Make it longer, or scale the whole scene up.",
        )
    return vector


def _not_flat(factor: float) -> float:
    if abs(factor) < MIN_SIZE:
        raise PydanticCustomError(
            "out_of_range",
            "A factor between -1e-100 and 1e-100 leaves nothing to see. Use a larger one; a negative one "
            "mirrors.",
        )
    return factor


def _countable(vector: Vector) -> Vector:
    if not SHORTEST <= max(map(abs, vector)) <= LONGEST:
        raise PydanticCustomError(
            "out_of_range",
            "The largest component of a direction must be between 1e-200 and 1e200: distances count in it. "
            "Multiply the direction by any number.",
        )
    return vector


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""Any finite number."""

Coordinate = Annotated[float, Field(strict=True, ge=-MAX_COORDINATE, le=MAX_COORDINATE, allow_inf_nan=False)]
Size = Annotated[float, Field(strict=True, ge=MIN_SIZE, le=MAX_COORDINATE, allow_inf_nan=False)]
Factor = Annotated[
    Coordinate,
    AfterValidator(_not_flat),
    Field(json_schema_extra={"not": {"exclusiveMinimum": -MIN_SIZE, "exclusiveMaximum": MIN_SIZE}}),
]
"""Scale factors of lengths; negative ones mirror."""
Intensity = Annotated[float, Field(strict=True, ge=0, le=MAX_INTENSITY, allow_inf_nan=False)]

Point = tuple[Coordinate, Coordinate, Coordinate]
Direction = Annotated[Point, AfterValidator(_not_zero)]
Edge = Annotated[Point, AfterValidator(_long_enough)]
_Start = Annotated[float, Field(strict=True, ge=-MAX_ORIGIN, le=MAX_ORIGIN, allow_inf_nan=False)]
RayOrigin = tuple[_Start, _Start, _Start]
RayDirection = Annotated[tuple[Number, Number, Number], AfterValidator(_not_zero), AfterValidator(_countable)]
TextureCoordinate = tuple[Coordinate, Coordinate]
Color = tuple[Intensity, Intensity, Intensity]

WHOLE = BeforeValidator(whole)
"""Goes with every strict `int`: a whole number may be written 32.0, as JSON Schema's `integer` allows."""

Count = Annotated[int, Field(strict=True, ge=1, le=1 << 16), WHOLE]
"""Pixels of one side, or samples of one kind: 1 to 65536."""

Index = Annotated[int, Field(strict=True, ge=0, lt=1 << 31), WHOLE]
"""A number in a list, from 0."""

Asset = Annotated[str, Field(strict=True, min_length=1, max_length=1024)]
"""The name of a file."""

LONGEST_NAME = 200
"""Characters of a name in a scene."""

Name = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_NAME)]
