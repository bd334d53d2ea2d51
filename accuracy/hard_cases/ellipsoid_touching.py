"""Hard cases: rays that touch ellipsoids, and rays that start on them, exactly."""

import math
from typing import Any

import numpy as np

from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.cases import Outcome, Section
from accuracy.hard_cases.round_formulas import quadratic
from accuracy.hard_cases.round_tolerances import along_the_ray, details, semi_axes
from accuracy.hard_cases.scoring import Tolerance, tried
from accuracy.hard_cases.whole_ellipsoids import exactly_tangent_rays, from_the_surface
from renderer.math.arrays import Floats

SECTION = Section("Ellipsoids")

TOUCHING = 16
"""Roundings of the start, in radii, by which a line may pass inside of the sphere that it touches."""


@SECTION.case(
    "exactly tangent rays",
    symptom="NaN pixels on the outline of a ball, or parts of it far in front of it.",
    cause="The discriminant is 0, and what is computed for it is rounding: its root is NaN where that is "
    "below 0, and many radii where the ray is long.",
    remedy="h <= 1 decides before any root is taken, and the root is that of (1 - h)(1 + h), which the "
    "length of the ray has no part in.",
    expected="A miss, or a hit within the root of 16 roundings of the start's distance in radii. Never NaN. "
    "Rays and places of whole numbers times powers of two, so that they touch exactly.",
    source="geometry",
)
def exactly_tangent() -> Outcome:
    """From 1 to a million radii away."""
    double, single = touching(np.float64), touching(np.float32)
    return tried(exactly_tangent_rays(), quadratic, double=double, single=single)


def touching(dtype: type[np.floating]) -> Tolerance:
    """Error of t where a line touches: half the chord of one that passes inside by some roundings."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del true
        axes = semi_axes(shape)
        rows = axes / (axes * axes).sum(axis=1)[:, None]
        away, length = (math.hypot(*(rows @ v)) for v in (origin - np.array(shape.center), direction))
        return math.sqrt(TOUCHING * float(np.finfo(dtype).eps) * away) / length

    return Tolerance(dtype, allowed)


@SECTION.case(
    "starts on the surface",
    symptom="Reflections on a ball are full of specks, or a ball of glass has no far side.",
    cause="c = |o|^2 - 1 should be 0, and is rounding of either sign: the start itself is hit again, or what "
    "is beyond it is lost.",
    remedy="A start within the rounding of |o|^2 is on the surface: it leaves, or goes through to the far "
    "root.",
    expected="A miss outwards; inwards the far side, t within 8 roundings of the largest coordinate, over "
    "the cosine. Starts are exactly on the surface.",
    source="geometry (whole numbers, as in 7^2 + 24^2 = 25^2)",
)
def on_the_surface() -> Outcome:
    """Of spheres, and of ellipsoids whose axes are powers of two of each other."""
    double = along_the_ray(8, np.float64)
    return tried(from_the_surface(), quadratic, double=double, details=details)
