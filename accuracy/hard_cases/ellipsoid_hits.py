"""Hard cases: which ellipsoids a ray meets, and where."""

import numpy as np

from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.round_families import ROUND, of_any_length
from accuracy.hard_cases.round_formulas import boxed_quadratic, quadratic
from accuracy.hard_cases.round_tolerances import along_the_ray, details, of_the_axes
from accuracy.hard_cases.scoring import DOUBLE, tried

SECTION = Section("Ellipsoids")

ROUNDED = along_the_ray(8, np.float64)
GEMS = "Haines et al., Ray Tracing Gems, ch. 7: the ray's closest approach in place of b^2 - 4ac"
PBRT = "Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 6.8"


@SECTION.case(
    "tiny spheres far away",
    symptom="Small balls in the distance have ragged outlines, or are seen at the wrong depth.",
    cause="b^2 and 4ac agree in all digits but the last ones, so that their difference is rounding.",
    remedy="The discriminant is (1 - h)(1 + h), h the distance of the ray from the centre in radii.",
    expected="Hit or miss right beyond 16 roundings from the outline, t within 1e-10 of itself.",
    source=GEMS,
)
def tiny_spheres_far_away() -> Outcome:
    """1e3 to 3e6 radii away."""
    return tried(ROUND["tiny spheres far away"](), quadratic, details=details)


@SECTION.case(
    "a giant sphere as the ground",
    symptom="Shadows and patterns crawl over a ground that is a huge sphere, or the ground has holes.",
    cause="The camera is so near, in radii, that |o|^2 - 1 keeps only a few digits of its height.",
    remedy="Hits are in float64, |o|^2 - 1 is (|o| - 1)(|o| + 1), and no hit is dropped for a small t.",
    expected="t within 4 roundings of the radius, over the cosine of the angle at which the ray arrives.",
    source=PBRT,
)
def giant_sphere() -> Outcome:
    """Radii of 1e5 to 1e7, two units below the camera."""
    return tried(ROUND["the ground"](), quadratic, double=of_the_axes(4, np.float64), details=details)


@SECTION.case(
    "starts close to the surface",
    symptom="Light bounces off a ball at the wrong place when its source is very near.",
    cause="-b + sqrt(b^2 - ac) subtracts two numbers that agree.",
    remedy="The larger root is a sum of one sign; the smaller one is their product over it.",
    expected="t within 16 roundings of the longest semi-axis, over the cosine: in float64 the plain root "
    "does as well, in float32 it is off by more than 1e-4 of t.",
    source=PBRT,
)
def close_starts() -> Outcome:
    """1e-6 to 0.1 of the semi-axes above and below the surface."""
    double = of_the_axes(16, np.float64)
    return tried(ROUND["from close to an ellipsoid"](), quadratic, double=double, details=details)


@SECTION.case(
    "axes a million to one",
    symptom="Discs and needles made of ellipsoids look torn, or turn up somewhere beside their place.",
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
    families = (ROUND["ellipsoids with axes far apart"], ROUND["thin ellipsoids seen from far away"])
    return total(tried(family(), quadratic, details=details) for family in families)


@SECTION.case(
    "centres far from the origin",
    symptom="Shapes of a scene in geographic coordinates shiver, and vanish as the camera nears them.",
    cause="One matrix for moving, turning and scaling adds the centre after it was multiplied.",
    remedy="The centre is subtracted first, then the 3 x 3 matrix brings the difference to the unit sphere.",
    expected="t within 1e-10 of itself, up to 1e12 units from the origin.",
    source="geometry",
)
def far_from_the_origin() -> Outcome:
    """Ellipsoids of about one unit, 1e2 to 1e12 units from the origin."""
    return tried(ROUND["ellipsoids far from the origin"](), quadratic, details=details)


@SECTION.case(
    "starts inside",
    symptom="The camera in a glass ball sees nothing of it.",
    cause="The smaller root is negative there, or lost in rounding just below the surface.",
    remedy="A start inside leaves by the larger root, whatever the smaller one is.",
    expected="Always a hit, t within 8 roundings of the largest coordinate, over the cosine.",
    source="geometry",
)
def inside() -> Outcome:
    """All depths from the centre to a millionth below the surface."""
    return tried(ROUND["from inside an ellipsoid"](), quadratic, double=ROUNDED, details=details)


@SECTION.case(
    "nearly tangent rays",
    symptom="Outlines of balls are ragged.",
    cause="The discriminant is a small difference of large numbers just where it decides.",
    remedy="(1 - h)(1 + h) is as exact as h, which comes from the part of the start across the ray.",
    expected="Hit or miss right beyond 16 roundings from the outline, t within 1e-10 of itself.",
    source=GEMS,
)
def nearly_tangent() -> Outcome:
    """At 1 - 0.1 to 1 - 1e-7, and 1 + 1e-7 to 1 + 0.1 radii from the centre."""
    return tried(ROUND["nearly tangent"](), quadratic, double=DOUBLE, details=details)


@SECTION.case(
    "ellipsoids behind the start",
    symptom="A ball that was just left, or is behind the camera, shows in front of it.",
    cause="Rounding moves a start just outside to the inside, where one root is positive.",
    remedy="A start within roundings of the surface is on it, and a ray that leaves from there meets "
    "nothing.",
    expected="Always a miss.",
    source="geometry",
)
def behind() -> Outcome:
    """Rays that look away from the centre, from 1e-12 to 100 semi-axes above the surface."""
    return tried(ROUND["ellipsoids behind"](), quadratic, double=ROUNDED)


@SECTION.case(
    "directions of any length",
    symptom="Rays with a direction in other units than the scene's hit nothing, or NaN.",
    cause="The direction's square is 0 or infinite in float32 from 1e-23 and 1e19 on, in float64 from 1e-162 "
    "and 1e154 on.",
    remedy="Directions are scaled by a power of two before anything is squared, and t is scaled back.",
    expected="t within 8 roundings of the largest coordinate, over the cosine, counted in the given units.",
    source="geometry",
)
def any_length() -> Outcome:
    """Lengths of 1e-30 to 1e25, and of 1e-198 to 1e198."""
    families = (ROUND["long and short directions"](), of_any_length("extremes", -198, 198))
    return total(tried(family, quadratic, double=ROUNDED, details=details) for family in families)


@SECTION.case(
    "zero and negative zero components",
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
    return tried(ROUND["directions with zeros"](), boxed_quadratic, details=details)
