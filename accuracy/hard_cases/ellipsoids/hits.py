"""Hard cases D: which ellipsoids a ray hits, and where."""

import math
import random
from typing import Any

import numpy as np

from accuracy.hard_cases.documents import Json
from accuracy.hard_cases.families import ROUND, Drawn, Ray, direction, family, listed, of_axes
from accuracy.hard_cases.formulas import boxed_quadratic, quadratic
from accuracy.hard_cases.harness import Outcome, Section, eps_of, total
from accuracy.hard_cases.oracle import Answer
from accuracy.hard_cases.scoring import (
    DOUBLE_TOLERANCE,
    Tolerance,
    of_the_axes,
    round_details,
    rounded,
    semi_axes,
    tried,
)
from renderer.math.arrays import Floats

SECTION = Section("Ellipsoids")

ROUNDED = rounded(np.float64)
GEMS = "Haines et al., Ray Tracing Gems, ch. 7: the ray's closest approach in place of b^2 - 4ac"
PBRT = "Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 6.8"


def _tried(name: str, double: Tolerance = DOUBLE_TOLERANCE) -> Outcome:
    return tried(ROUND[name](), quadratic, double=double, details=round_details)


@SECTION.case(
    "D1: tiny spheres far away",
    symptom="Small balls in the distance have ragged outlines, or are seen at the wrong depth.",
    cause="b^2 and 4ac agree in all digits but the last ones, so that their difference is rounding.",
    remedy="The discriminant is (1 - h)(1 + h), h the distance of the ray from the centre in radii.",
    expected="Hit or miss right beyond 16 roundings from the outline, t within 1e-10 of itself.",
    source=GEMS,
)
def tiny_spheres_far_away() -> Outcome:
    """1e3 to 3e6 radii away."""
    return _tried("tiny spheres far away")


@SECTION.case(
    "D2: a giant sphere as the ground",
    symptom="Shadows and patterns crawl over a ground that is a huge sphere, or the ground has holes.",
    cause="The camera is so near, in radii, that |o|^2 - 1 keeps only a few digits of its height.",
    remedy="Hits are in float64, |o|^2 - 1 is (|o| - 1)(|o| + 1), and no hit is dropped for a small t.",
    expected="t within 4 roundings of the radius, over the cosine of the angle at which the ray arrives.",
    source=PBRT,
)
def giant_sphere() -> Outcome:
    """Radii of 1e5 to 1e7, two units below the camera."""
    return _tried("the ground", of_the_axes(4, np.float64))


@SECTION.case(
    "D3: starts close to the surface",
    symptom="Light bounces off a ball at the wrong place when its source is very near.",
    cause="-b + sqrt(b^2 - ac) subtracts two numbers that agree.",
    remedy="The larger root is a sum of one sign; the smaller one is their product over it.",
    expected="t within 16 roundings of the longest semi-axis, over the cosine: in float64 the plain root "
    "does as well, in float32 it is off by more than 1e-4 of t.",
    source=PBRT,
)
def close_starts() -> Outcome:
    """1e-6 to 0.1 of the semi-axes above and below the surface."""
    return _tried("from close to the surface", of_the_axes(16, np.float64))


@SECTION.case(
    "D4: axes a million to one",
    symptom="Discs and needles made of ellipsoids fall apart, or turn up somewhere beside their place.",
    cause="Where the shape becomes a sphere, the ray is up to 1e18 radii long, and one rounding of its "
    "length is longer than the sphere.",
    remedy="The start's part across the ray is projected twice; rounding of t is taken back along the ray, "
    "never towards the centre; a start outside always enters.",
    expected="t within 1e-10 of itself, places within 8 roundings of the largest coordinate, over the "
    "cosine.",
    source=f"{GEMS}; the second projection: measured",
)
def axes_far_apart() -> Outcome:
    """Semi-axes down to a millionth of the longest, from 3 to 1e12 times that away."""
    return total(map(_tried, ("axes far apart", "thin and far away")))


@SECTION.case(
    "D5: centres far from the origin",
    symptom="Shapes of a scene in geographic coordinates shiver, and vanish as the camera nears them.",
    cause="One matrix for moving, turning and scaling adds the centre after it was multiplied.",
    remedy="The centre is subtracted first, then the 3 x 3 matrix brings the difference to the unit sphere.",
    expected="t within 1e-10 of itself, up to 1e12 units from the origin.",
)
def far_from_the_origin() -> Outcome:
    """Ellipsoids of about one unit, 1e2 to 1e12 units from the origin."""
    return _tried("far from the origin")


@SECTION.case(
    "D6: starts inside",
    symptom="The camera in a glass ball sees nothing of it.",
    cause="The smaller root is negative there, or lost in rounding just below the surface.",
    remedy="A start inside leaves by the larger root, whatever the smaller one is.",
    expected="Always a hit, t within 8 roundings of the largest coordinate, over the cosine.",
)
def inside() -> Outcome:
    """All depths from the centre to a millionth below the surface."""
    return _tried("from inside", ROUNDED)


@SECTION.case(
    "D8: nearly tangent rays",
    symptom="Outlines of balls are ragged.",
    cause="The discriminant is a small difference of large numbers just where it decides.",
    remedy="(1 - h)(1 + h) is as exact as h, which comes from the part of the start across the ray.",
    expected="Hit or miss right beyond 16 roundings from the outline, t within 1e-10 of itself.",
    source=GEMS,
)
def nearly_tangent() -> Outcome:
    """At 1 - 0.1 to 1 - 1e-7, and 1 + 1e-7 to 1 + 0.1 radii from the centre."""
    return _tried("nearly tangent")


@SECTION.case(
    "D10: ellipsoids behind the start",
    symptom="A ball that was just left, or is behind the camera, shows in front of it.",
    cause="Rounding moves a start just outside to the inside, where one root is positive.",
    remedy="A start within roundings of the surface is on it, and a ray that leaves from there hits nothing.",
    expected="Always a miss.",
)
def behind() -> Outcome:
    """Rays that look away from the centre, from 1e-12 to 100 semi-axes above the surface."""
    return tried(ROUND["behind"](), quadratic, double=ROUNDED)


@SECTION.case(
    "D11: directions of any length",
    symptom="Rays with a direction in other units than the scene's hit nothing, or NaN.",
    cause="The direction's square is 0 or infinite in float32 from 1e-23 and 1e19 on, in float64 from 1e-162 "
    "and 1e154 on.",
    remedy="Directions are scaled by a power of two before anything is squared, and t is scaled back.",
    expected="t within 8 roundings of the largest coordinate, over the cosine, counted in the given units.",
)
def any_length() -> Outcome:
    """Lengths of 1e-30 to 1e25, and of 1e-198 to 1e198."""
    return total(_tried(name, ROUNDED) for name in ("long and short directions", "extreme directions"))


@SECTION.case(
    "D12: zero and negative zero components",
    symptom="A row or a column of pixels in the middle of the picture misses a shape.",
    cause="Dividing by -0 swaps the sides of a box: a test that asks d >= 0 finds it left before it is "
    "entered.",
    remedy="No box is tested before an ellipsoid; nothing is divided by a component of the direction.",
    expected="The sign of a zero says nothing: hits and misses are right for both.",
    source="Williams, Barrus, Morley and Shirley 2005, An Efficient and Robust Ray-Box Intersection "
    "Algorithm",
)
def zeros() -> Outcome:
    """Directions along the axes and in the planes of the axes."""
    return tried(ROUND["directions with zeros"](), boxed_quadratic, details=round_details)


TOUCHING = 16
"""Roundings of the start, in radii, by which a line may pass inside of the sphere that it touches."""


@SECTION.case(
    "D7: exactly tangent rays",
    symptom="NaN pixels on the outline of a ball, or parts of it far in front of it.",
    cause="The discriminant is 0, and what is computed for it is rounding: its root is NaN where that is "
    "below 0, and many radii where the ray is long.",
    remedy="h <= 1 decides before any root is taken, and the root is that of (1 - h)(1 + h), which the "
    "length of the ray has no part in.",
    expected="A miss, or a hit within the root of 16 roundings of the start's distance in radii. Never NaN. "
    "Rays and places of whole numbers times powers of two, so that they touch exactly.",
)
def exactly_tangent() -> Outcome:
    """From 1 to a million radii away."""
    double, single = touching(np.float64), touching(np.float32)
    return tried(family("exactly tangent", in_tangent_planes), quadratic, double=double, single=single)


def touching(dtype: type[np.floating]) -> Tolerance:
    """Error of t where a line touches: half the chord of one that passes inside by some roundings."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del true
        axes = semi_axes(shape)
        rows = axes / (axes * axes).sum(axis=1)[:, None]
        away, length = (math.hypot(*(rows @ v)) for v in (origin - np.array(shape.center), direction))
        return math.sqrt(TOUCHING * eps_of(dtype) * away) / length

    return Tolerance(dtype, allowed)


@SECTION.case(
    "D9: starts on the surface",
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
    rays = family("from the surface", from_the_surface)
    return tried(rays, quadratic, double=ROUNDED, details=round_details)


RADIUS = 25.0
ON_SPHERE = [(7, 24, 0), (15, 20, 0), (9, 12, 20), (12, 15, 16), (25, 0, 0)]
"""Whole numbers whose squares add up to that of the radius."""


def placed_exactly(chosen: random.Random) -> tuple[Json, Floats, Floats]:
    """An ellipsoid, a place exactly on it, and a vector along the normal there, (3,) each.

    All are whole numbers times powers of two. The frame has rows of one length by Euler's parametrisation of
    rotations.
    """
    a, b, c, d = (chosen.randint(low, 3) for low in (-3, -3, -3, 1))
    rows = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
    place = np.array(chosen.sample(chosen.choice(ON_SPHERE), 3)) * [chosen.choice([-1, 1]) for _ in range(3)]
    middle = np.array([chosen.randint(-50, 50) for _ in range(3)])
    powers = 2.0 ** np.array([chosen.randint(-3, 3) for _ in range(3)])
    shape = of_axes(middle, RADIUS * powers[:, None] * rows)
    return shape, middle + (place * powers) @ rows, (place / powers) @ rows


def in_tangent_planes(chosen: random.Random) -> Drawn:
    """Rays in tangent planes through the place where these touch, from up to some million radii away."""
    shape, place, normal = placed_exactly(chosen)

    def ray() -> Ray:
        along = np.cross(normal, [chosen.randint(-9, 9) for _ in range(3)])
        along = along if along.any() else np.cross(normal, normal[[1, 2, 0]])
        return listed(place - 2.0 ** chosen.randint(0, 16) * along), listed(along)

    return shape, ray


def from_the_surface(chosen: random.Random) -> Drawn:
    """Rays in all directions from places exactly on ellipsoids."""
    shape, place, _ = placed_exactly(chosen)
    return shape, lambda: (listed(place), direction(chosen))
