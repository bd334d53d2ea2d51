"""Hard cases F: highlights, reflected directions, back faces, and normals that face away.

Highlights are those of a floor in the plane y = 0 under a sun, seen from any direction above it: normal,
light and viewer are the numbers of the scene, so the exact colour is one formula of them.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial, reduce
from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.documents import dark_scene, lamp, phong, rectangle, sampled, scene, sun, triangle
from accuracy.hard_cases.harness import (
    DOUBLE,
    EPS,
    SINGLE,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    eps_of,
    exact,
    in_both,
    judged,
    points,
    radiance,
    tally,
)
from renderer.materials.optics import reflected
from renderer.math.arrays import Floats, dot, unit
from schemas.quality import FixedQuality

STRENGTH = 0.75
"""Of the highlights."""

BOTH = (DOUBLE, SINGLE)
UP = np.array([[0.0], [1.0], [0.0]])
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])


def highlights(light: Floats | None, viewers: Floats, shininess: float, quality: FixedQuality) -> Floats:
    """What Penumbra shows towards viewers (3, N), (N,), of a sun in a direction (3, 1) or of the lamp."""
    document = dark_scene(
        FLOOR,
        lights=[LAMP if light is None else sun(-light[:, 0], [1, 1, 1])],
        materials={"plain": phong(ambient=0.0, diffuse=0.0, specular=STRENGTH, shininess=shininess)},
        sampling=sampled(1, POINTS),
    )
    return radiance(compiled(document, quality), viewers, -viewers)[0]


LAMP = lamp([-1, 0.5, -1], [2, 0, 0], [0, 0, 2], [1, 1, 1], visible=False)
"""Above the floor; what the floor mirrors of it reaches past the horizon of most viewers."""

POINTS = 16


def lamp_points() -> list[Floats]:
    """Directions (3, 1) of the light points of the lamp from the origin."""
    places = (np.arange(4) + 0.5) / 4
    return [np.array([[-1 + 2 * u], [0.5], [-1 + 2 * v]]) for v in places for u in places]


def plain_cosines(light: Floats, viewers: Floats, dtype: Any) -> Floats:
    """R . v as textbooks write it, on unit vectors rounded to `dtype`."""
    towards, seen = unit(light).astype(dtype), unit(viewers).astype(dtype)
    up = UP.astype(dtype)
    return dot(dtype(2) * dot(up, towards) * up - towards, seen)


def plain_highlights(light: Floats, viewers: Floats, shininess: float, dtype: Any) -> Floats:
    """STRENGTH * max(0, r . v) ** shininess as textbooks write it."""
    powers = np.maximum(plain_cosines(light, viewers, dtype), dtype(0)) ** dtype(shininess)
    return (dtype(STRENGTH) * powers).astype(np.float64)


@exact
def exact_highlights(light: Floats, viewers: Floats, shininess: float) -> Floats:
    """The same to 50 digits, rounded once; for lights above the floor."""
    values = []
    towards = [mpmath.mpf(x) for x in light[:, 0].tolist()]
    length = mpmath.sqrt(mpmath.fsum(x * x for x in towards))
    for viewer in viewers.T.tolist():
        seen = [mpmath.mpf(x) for x in viewer]
        product = -towards[0] * seen[0] + towards[1] * seen[1] - towards[2] * seen[2]
        cosine = product / length / mpmath.sqrt(mpmath.fsum(x * x for x in seen))
        values.append(float(STRENGTH * cosine**shininess) if cosine > 0 else 0.0)
    return np.array(values)


def lights(count: int, seed: int) -> list[Floats]:
    """Directions (3, 1) above the floor, at least 10 degrees."""
    rng = np.random.default_rng(seed)
    height, turn = rng.uniform(0.2, 0.95, count), rng.uniform(0, 2 * np.pi, count)
    across = np.sqrt(1 - height**2)
    directions = np.stack((across * np.cos(turn), height, across * np.sin(turn)))
    return [directions[:, i : i + 1] for i in range(count)]


def mirrored(light: Floats) -> Floats:
    """The direction (3, 1) in which the floor reflects a light: two signs, without any rounding."""
    return light * np.array([[-1.0], [1.0], [-1.0]])


def somewhere(count: int, seed: int) -> Floats:
    """Viewers (3, count) above the floor."""
    directions = unit(np.random.default_rng(seed).normal(size=(3, count)))
    directions[1] = np.abs(directions[1]) + 2.0**-7
    return directions


def away_from(axis: Floats, cosines: Floats, seed: int) -> Floats:
    """Directions (3, n) above the floor at angles to an axis whose cosines (N,) are given, n of N."""
    turn = np.random.default_rng(seed).uniform(-1, 1, cosines.size)
    beside = unit(np.cross(axis, UP, axis=0))
    above = unit(UP - axis * dot(axis, UP))
    across = np.cos(turn) * above + np.sin(turn) * beside
    directions = cosines * axis + np.sqrt((1 - cosines) * (1 + cosines)) * across
    return directions[:, directions[1] > 0.01]


def exponent_0() -> Outcomes:
    """Cosines of exactly 0, below 0 and above 0, and light from below."""
    depth = np.random.default_rng(1).uniform(-3, 3, 250)
    level = np.stack((np.ones(250), np.ones(250), depth))
    diagonal = np.array([[1.0], [1.0], [0.0]])
    asked = [(diagonal, level, 0.0), (-UP + [[0.3], [0.0], [0.1]], level, 0.0)]
    for light in lights(4, 2):
        away = away_from(mirrored(light), np.random.default_rng(3).uniform(-0.9, -1e-6, 150), 4)
        near = away_from(mirrored(light), np.random.default_rng(5).uniform(1e-6, 1, 50), 6)
        asked += [(light, away, 0.0), (light, near, STRENGTH)]
    viewers = somewhere(400, 14)
    seen = sum(plain_cosines(light, viewers, np.float64) > 0 for light in lamp_points()) / POINTS
    parts = [(None, viewers, STRENGTH * seen), *asked]
    return (_step(*part, quality) for part in parts for quality in BOTH)


def _step(light: Floats | None, viewers: Floats, expected: Any, quality: FixedQuality) -> Outcome:
    """Highlights of the exponent 0 of a sun, or of the lamp where there is none."""
    every = lamp_points() if light is None else [light]

    def plain(dtype: Any) -> Floats:
        return reduce(np.add, (plain_highlights(part, viewers, 0.0, dtype) for part in every)) / len(every)

    found = highlights(light, viewers, 0.0, quality)
    return Outcome(found.size, *(tally(seen != expected) for seen in (found, *in_both(plain))))


def negative_cosines() -> Iterator[Outcomes]:
    """Cosines from -1 to -1e-9, exponents that are not whole; and a lamp of which a part is mirrored away."""
    yield (_half_mirrored(shininess, quality) for shininess in (0.5, 50.5) for quality in BOTH)
    for number, light in enumerate(lights(6, 7)):
        cosines = -(10 ** np.random.default_rng(number).uniform(-9, 0, 130))
        viewers = away_from(mirrored(light), cosines, number)
        shininess = (0.5, 50.5, 900.1)[number % 3]
        for quality in BOTH:
            found = highlights(light, viewers, shininess, quality)
            with np.errstate(invalid="ignore"):
                plain = plain_cosines(light, viewers, np.float64) ** shininess
            yield Outcome(found.size, tally(found != 0), tally(plain != 0))


def _half_mirrored(shininess: float, quality: FixedQuality) -> Outcome:
    """The mean over the points of the lamp; half a hundred roundings times the exponent are right."""
    viewers = somewhere(300, 15)
    cosines = np.stack([plain_cosines(light, viewers, np.float64) for light in lamp_points()])
    true = STRENGTH * (np.maximum(cosines, 0) ** shininess).mean(axis=0)
    with np.errstate(invalid="ignore"):
        plain = STRENGTH * (cosines**shininess).mean(axis=0)
    allowed = 50 * shininess * eps_of(quality.precision)
    off = np.abs(highlights(None, viewers, shininess, quality) - true) / allowed
    return judged(off, np.abs(plain - true))


def sharp() -> Iterator[Outcomes]:
    """Angles at which the highlight falls from its height to 6e-6 of it."""
    for number, light in enumerate(lights(8, 8)):
        shininess = (1e4, 1e5, 1e6, 1e7)[number % 4]
        fall = np.random.default_rng(number).uniform(0, 12, 70)
        viewers = away_from(mirrored(light), 1 - fall / shininess, number)
        asked = light, viewers, shininess
        true = exact_highlights(*asked)
        yield [_within(highlights(*asked, quality), true, 1e-6, asked) for quality in BOTH]


def _within(found: Floats, true: Floats, share: float, asked: tuple[Floats, Floats, float]) -> Outcome:
    """Answers off by more than a share of the true ones, or above the strength."""

    def errors(values: Floats) -> Floats:
        return np.where(values > STRENGTH, np.inf, np.abs(values - true) / (share * true))

    return judged(errors(found), *map(errors, in_both(partial(plain_highlights, *asked))))


def straight() -> Iterator[Outcomes]:
    """Viewers exactly in the direction of the mirrored light."""
    for number, light in enumerate(lights(500, 9)[::5]):
        shininess = (1.0, 20.0, 128.0, 1e4, 1e7)[number % 5]
        scales = np.random.default_rng(number).uniform(0.1, 3, 10)
        viewers = mirrored(light) * scales
        quality = BOTH[number // 5 % 2]
        rounding = eps_of(np.float32) if quality is SINGLE and shininess <= 128 else EPS
        asked = light, viewers, shininess
        true = np.full(viewers.shape[1], STRENGTH)
        yield _within(highlights(*asked, quality), true, 16 * rounding * shininess, asked)


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


def from_behind() -> Iterator[Outcomes]:
    """One triangle by both windings, from both sides, with lights on both sides."""
    rng = np.random.default_rng(11)
    targets = (rng.dirichlet((2, 2, 2), 500) @ np.array(FRONT)).T
    for quality in (DOUBLE, SINGLE):
        for side in (1.0, -1.0):
            viewers = unit(rng.normal(size=(3, 500)) + 2 * side * UP)
            seen, swapped = (
                radiance(compiled(_two_suns(corners), quality), targets + viewers, -viewers)
                for corners in (FRONT, FRONT[::-1])
            )
            off = np.abs(seen - swapped).max(axis=0) / (64 * 20 * eps_of(quality.precision))
            yield judged(np.where(seen.max(axis=0) == 0, np.inf, off))


def _two_suns(corners: Any) -> dict[str, Any]:
    return dark_scene(
        triangle(*corners),
        lights=[sun([0.3, -1, 0.2]), sun([0.1, 1, -0.4])],
        materials={"plain": phong(ambient=0.0, specular=STRENGTH, shininess=20)},
    )


TIPPED = 150.0
"""Degrees by which the last normal of a sweep is tilted."""

STEPS = 200


def facing_away() -> Iterator[Outcomes]:
    """A triangle whose normals tilt by 150 degrees from one corner to the next, in many directions."""
    rng = np.random.default_rng(12)
    for number in range(20):
        turn, height, towards = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.9), lights(20, 13)[number]
        viewer = np.array([[np.sqrt(1 - height**2)], [height], [0.0]])
        tilt = np.radians(TIPPED)
        last = np.array([[np.sin(tilt) * np.cos(turn)], [np.cos(tilt)], [np.sin(tilt) * np.sin(turn)]])
        yield _sweep(last, viewer, towards, BOTH[number % 2])
        yield _sweep(last, viewer, -towards, BOTH[number % 2])
    yield (_half_below(quality) for quality in BOTH)


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
    document = dark_scene(
        triangle([-4, 0, -4], [-4, 0, 4], [8, 0, 0], normals=leaning),
        lights=[lamp([3, bottom, -0.5], [0, 1, 0], [0, 0, 1], [1, 1, 1], visible=False)],
        sampling=sampled(1, POINTS),
    )
    return float(radiance(compiled(document, quality), UP, -UP)[0, 0])


def _sweep(last: Floats, viewer: Floats, light: Floats, quality: FixedQuality) -> Outcome:
    share = (np.arange(STEPS) + 0.5) / STEPS
    flat = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], normals=[[0, 1, 0], [0, 1, 0], last[:, 0]])
    document = dark_scene(
        flat,
        lights=[sun(-light[:, 0], [1, 1, 1])],
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


CASES: Cases = {
    "F1: exponent 0": exponent_0,
    "F2: powers of negative cosines": negative_cosines,
    "F3: very sharp highlights": sharp,
    "F7: straight into the mirrored light": straight,
    "F4: mirrors at a grazing angle": grazing_mirrors,
    "F6: seen from behind": from_behind,
    "F5: shading normals that face away": facing_away,
    "F8: normals straight away from the viewer": straight_away,
}
