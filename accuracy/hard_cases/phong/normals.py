"""Hard cases F: reflected directions, sides, and normals that face away."""

import math
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.documents import lamp, phong, sampled, scene, sun, triangle
from accuracy.hard_cases.harness import (
    DOUBLE,
    EPS,
    SINGLE,
    Outcome,
    Section,
    compiled,
    eps_of,
    exact,
    in_both,
    judged,
    points,
    radiance,
    tally,
    total,
)
from accuracy.hard_cases.phong.highlights import BOTH, POINTS, STRENGTH, UP, lights
from renderer.materials.optics import reflected
from renderer.math.arrays import Floats, dot, unit
from schemas.quality import FixedQuality

SECTION = Section("Shading normals")


@SECTION.case(
    "F4: mirrors at a grazing angle",
    symptom="Reflections in a floor seen from its own height are off, more so after every bounce.",
    cause="2 (n . v) n - v has length 1 only up to the rounding of n and v, and bounces multiply it.",
    remedy="Directions are reflected in float64 and made unit again, after none goes below the surface.",
    expected="Length 1 within 4 eps, and each component within 8 eps of the reflection to 50 digits.",
)
def grazing_mirrors() -> Outcome:
    """Cosines from 1e-12 to 0.1 at normals in any direction."""
    rng = np.random.default_rng(10)
    normals = unit(rng.normal(size=(3, 1000)))
    along = unit(np.cross(normals, rng.normal(size=(3, 1000)), axis=0))
    viewers = unit(along + normals * 10 ** rng.uniform(-12, -1, 1000))
    true = exact_reflections(viewers, normals)

    def errors(directions: Floats) -> Floats:
        directions = directions.astype(np.float64)
        lengths = np.abs(np.sqrt(dot(directions, directions)) - 1) / (4 * EPS)
        return np.maximum(lengths, np.abs(directions - true).max(axis=0) / (8 * EPS))

    def plain(dtype: type[np.floating]) -> Floats:
        n, v = normals.astype(dtype), viewers.astype(dtype)
        return errors(2 * (n[0] * v[0] + n[1] * v[1] + n[2] * v[2]) * n - v)

    return judged(errors(reflected(viewers, normals, normals)), *in_both(plain))


@exact
def exact_reflections(viewers: Floats, normals: Floats) -> Floats:
    """Directions (3, N) in which mirrors of normals (3, N) show what comes to viewers (3, N)."""
    columns = []
    for viewer, normal in zip(viewers.T.tolist(), normals.T.tolist(), strict=True):
        v, n = (mpmath.matrix(vector) / mpmath.norm(mpmath.matrix(vector)) for vector in (viewer, normal))
        columns.append([float(x) for x in 2 * (v.T * n)[0] * n - v])
    return np.array(columns).T


FRONT = ([-2.0, 0.0, -1.0], [0.5, 0.3, 2.0], [2.0, -0.2, -1.0])


@SECTION.case(
    "F6: seen from behind",
    symptom="Triangles with the other winding are black, or lit by what is behind them.",
    cause="n . l is taken with the normal of the winding, whatever side the viewer is on.",
    remedy="The true normal is turned to the side the ray comes from, once, where the ray hits.",
    expected="The same colours with two corners swapped, within 64 roundings times the exponent.",
)
def from_behind() -> Outcome:
    """One triangle by both windings, from both sides, with lights on both sides."""
    rng = np.random.default_rng(11)
    targets = (rng.dirichlet((2, 2, 2), 500) @ np.array(FRONT)).T
    parts = []
    for quality in (DOUBLE, SINGLE):
        for side in (1.0, -1.0):
            viewers = unit(rng.normal(size=(3, 500)) + 2 * side * UP)
            seen, swapped = (
                radiance(compiled(_two_suns(corners), quality), targets + viewers, -viewers)
                for corners in (FRONT, FRONT[::-1])
            )
            off = np.abs(seen - swapped).max(axis=0) / (64 * 20 * eps_of(quality.precision))
            parts.append(judged(np.where(seen.max(axis=0) == 0, np.inf, off)))
    return total(parts)


def _two_suns(corners: Any) -> dict[str, Any]:
    return scene(
        triangle(*corners),
        lights=[sun([0.3, -1, 0.2]), sun([0.1, 1, -0.4])],
        ambient=[0, 0, 0],
        materials={"plain": phong(ambient=0.0, specular=STRENGTH, shininess=20)},
    )


TIPPED = 150.0
"""Degrees by which the last normal of a sweep is tilted."""

STEPS = 200


@SECTION.case(
    "F5: shading normals that face away",
    symptom="Black holes, or stripes of light from the wrong side, on the rims of smooth meshes.",
    cause="Interpolated and mapped normals may point away from the viewer: cut off there the surface is "
    "black, turned over it is lit from behind, with a jump.",
    remedy="They are bent to the horizon, after all that tilts them, and what is below the true surface does "
    "not light it.",
    expected="The colour of the bent normal within 64 roundings over the sine of its angle to the viewer; "
    "from step to step no more change than the normal's own; no light from below.",
)
def facing_away() -> Outcome:
    """A triangle whose normals tilt by 150 degrees from one corner to the next, in many directions."""
    rng = np.random.default_rng(12)
    parts = []
    for number in range(20):
        turn, height, towards = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.9), lights(20, 13)[number]
        viewer = np.array([[np.sqrt(1 - height**2)], [height], [0.0]])
        tilt = np.radians(TIPPED)
        last = np.array([[np.sin(tilt) * np.cos(turn)], [np.cos(tilt)], [np.sin(tilt) * np.sin(turn)]])
        parts.append(_sweep(last, viewer, towards, BOTH[number % 2]))
        parts.append(_sweep(last, viewer, -towards, BOTH[number % 2]))
    return total([*parts, *(_half_below(quality) for quality in BOTH)])


def _half_below(quality: FixedQuality) -> Outcome:
    """A floor whose normals lean towards a lamp that goes down through the plane of the floor."""
    off, plain = [], []
    for bottom in np.linspace(-0.9, 0.7, 40).tolist():
        places = bottom + (np.arange(4) + 0.5) / 4
        across = (-0.375, -0.125, 0.125, 0.375)
        cosines = np.array([(3 + y) / math.sqrt(2 * (9 + y * y + z * z)) for y in places for z in across])
        true = (cosines * np.repeat(places > 0, 4)).mean()
        off.append(_leaning(bottom, quality) - true)
        plain.append(cosines.mean() - true)
    allowed = 64 * eps_of(quality.precision)
    return judged(np.abs(off) / allowed, np.abs(plain) / allowed)


def _leaning(bottom: float, quality: FixedQuality) -> float:
    leaning = [[1.0, 1.0, 0.0]] * 3
    document = scene(
        triangle([-4, 0, -4], [-4, 0, 4], [8, 0, 0], normals=leaning),
        lights=[lamp([3, bottom, -0.5], [0, 1, 0], [0, 0, 1], [1, 1, 1], visible=False)],
        ambient=[0, 0, 0],
        materials={"plain": phong([1, 1, 1], ambient=0.0, diffuse=1.0)},
        sampling=sampled(1, POINTS),
    )
    return float(radiance(compiled(document, quality), UP, -UP)[0, 0])


def _sweep(last: Floats, viewer: Floats, light: Floats, quality: FixedQuality) -> Outcome:
    share = (np.arange(STEPS) + 0.5) / STEPS
    flat = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], normals=[[0, 1, 0], [0, 1, 0], last[:, 0]])
    document = scene(
        flat,
        lights=[sun(-light[:, 0], [1, 1, 1])],
        ambient=[0, 0, 0],
        materials={"plain": phong([1, 1, 1], ambient=0.0, diffuse=1.0)},
    )
    targets = np.stack((-4 + 8 * share, np.zeros(STEPS), np.full(STEPS, -4 + 2.0**-20)))
    seen = radiance(compiled(document, quality), targets + viewer, np.repeat(-viewer, STEPS, axis=1))[0]
    normals = unit((1 - share) * UP + share * last)
    cosines = dot(normals, viewer)
    across = np.sqrt((1 - cosines) * (1 + cosines))
    bent = np.where(cosines < 0, unit(normals - viewer * cosines), normals)
    least = np.where(cosines < 0, across, 1.0)
    rounding = eps_of(quality.precision)
    expected = np.maximum(dot(bent, light), 0) * (light[1] > 0)
    off = np.abs(seen - expected) / (64 * rounding / least)
    # A quarter of a turn is the longest arc over its chord.
    change = np.sqrt(dot(normals[:, 1:] - normals[:, :-1], normals[:, 1:] - normals[:, :-1])) * np.pi / 2
    most = change / np.minimum(least[1:], least[:-1]) + 64 * rounding
    turned = normals * np.where(cosines < 0, -1.0, 1.0)
    jumps = tally(np.abs(np.diff(np.maximum(dot(turned, light), 0))) > most)
    judgement = judged(off)
    return replace(judgement, wrong=judgement.wrong + tally(np.abs(np.diff(seen)) > most), textbook=jumps)


@SECTION.case(
    "F8: normals straight away from the viewer",
    symptom="Single black pixels where the normals around a point cancel, or all point away.",
    cause="What is left of them across the line of sight is 0, or the rounding of 0, and has no direction.",
    remedy="Where less than 1e-6 is left, the true normal stands in.",
    expected="A normal of length 1 within 4 eps, on the viewer's side of the horizon within 1e-6.",
)
def straight_away() -> Outcome:
    """Triangles that each have a point whose smooth normal is 0, or looks straight away from its viewer."""
    rng = np.random.default_rng(16)
    count = 1000
    lasts = unit(np.stack((rng.normal(size=count), -0.5 - rng.random(count), rng.normal(size=count))))
    shares = rng.uniform(0.75, 0.95, count)
    lasts[:, ::5], shares[::5] = -UP, 0.5
    smooth = (1 - shares) * UP + shares * lasts
    viewers = -unit(smooth)
    viewers[:, ::5] = lights(1, 17)[0]
    shapes = [
        triangle([3 * i, 0, 0], [3 * i, 0, 2], [3 * i + 2, 0, 0], normals=[[0, 1, 0], [0, 1, 0], last])
        for i, last in enumerate(lasts.T)
    ]
    targets = np.stack((3.0 * np.arange(count) + 2 * shares, np.zeros(count), np.full(count, 2.0**-20)))
    plan = compiled(scene(*shapes, materials={"plain": phong()}), DOUBLE)
    normals = points(plan, targets + viewers, -viewers).shading_normals

    def wrong(found: Floats) -> int:
        long = np.abs(np.sqrt(dot(found, found)) - 1) <= 4 * EPS
        return tally(~(long & (dot(found, viewers) >= -1e-6)))

    with np.errstate(invalid="ignore"):
        across = smooth - viewers * dot(smooth, viewers)
        plain = across / np.sqrt(dot(across, across))
    return Outcome(count, wrong(normals), wrong(plain))
