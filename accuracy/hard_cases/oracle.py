"""Exact answers to what a ray hits: rational numbers for flat shapes, 200 binary digits for ellipsoids.

The numbers of a scene are doubles, and every double is a rational number, so a flat shape's answer has no
error at all. `margin` is how near to the border between hit and miss a ray passes, relative to the shape:
an answer within roundings of the border is a matter of opinion, any other is not.
"""

from typing import Any

from accuracy.hard_cases import flat_oracle, round_oracle
from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.exact_vectors import Vector

ANSWERS = {
    "triangle": flat_oracle.triangle,
    "rectangle": flat_oracle.rectangle,
    "ellipsoid": round_oracle.ellipsoid,
}


def answer(shape: Any, origin: Vector, direction: Vector) -> Answer:
    """What one ray meets on one shape of the scene language."""
    return ANSWERS[shape.type](shape, origin, direction)
