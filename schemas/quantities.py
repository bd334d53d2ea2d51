"""Numbers of the scene language: strict, finite, bounded, each with its unit.

Coordinates stay below 1e15, so that squares and cubes of them are finite in float64. Sizes stay above
1e-100, so that squares of them do not vanish.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from schemas.vectors import Vector, length

LARGEST = 1e15
"""Bound of every coordinate and size, scene units."""

SMALLEST = 1e-100
"""Smallest size, radius and edge, scene units."""

BRIGHTEST = 1e30
"""Bound of every colour and coefficient."""

FARTHEST = 1e30
"""Bound of the coordinates of a ray's origin, scene units: doubles beyond are as far apart as shapes."""

SHORTEST, LONGEST = 1e-200, 1e200
"""Bounds of the largest component of a ray's direction: counted in it, t is neither 0 nor infinite."""


def whole(number: object) -> object:
    """Read 32.0 as 32, for JSON has one kind of number; what is no whole number stays as it is."""
    return int(number) if isinstance(number, float) and number.is_integer() else number


def _not_zero(vector: Vector) -> Vector:
    if not any(vector):
        raise PydanticCustomError(
            "zero_vector",
            "This vector is zero and has no direction. Make one of its components other than 0.",
        )
    return vector


def _long_enough(vector: Vector) -> Vector:
    if length(vector) < SMALLEST:
        raise PydanticCustomError(
            "no_length",
            "This vector is zero or shorter than 1e-100. Make it longer, or scale the whole scene up.",
        )
    return vector


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

Coordinate = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Size = Annotated[float, Field(strict=True, ge=SMALLEST, le=LARGEST, allow_inf_nan=False)]
Intensity = Annotated[float, Field(strict=True, ge=0, le=BRIGHTEST, allow_inf_nan=False)]

Point = tuple[Coordinate, Coordinate, Coordinate]
Direction = Annotated[Point, AfterValidator(_not_zero)]
Edge = Annotated[Point, AfterValidator(_long_enough)]
_Start = Annotated[float, Field(strict=True, ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
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

Name = Annotated[str, Field(strict=True, min_length=1, max_length=200)]
