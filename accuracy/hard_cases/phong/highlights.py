"""Hard cases F: highlights.

A floor in the plane y = 0 under a sun, seen from any direction above it: normal, light and viewer are the
numbers of the scene, so the exact colour is one formula of them.
"""

from functools import partial, reduce
from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.documents import lamp, phong, rectangle, sampled, scene, sun
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
    radiance,
    tally,
    total,
)
from renderer.math.arrays import Floats, dot, unit
from schemas.quality import FixedQuality

SECTION = Section("Highlights")

STRENGTH = 0.75
"""Of the highlights."""

BOTH = (DOUBLE, SINGLE)
UP = np.array([[0.0], [1.0], [0.0]])
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])


def highlights(light: Floats | None, viewers: Floats, shininess: float, quality: FixedQuality) -> Floats:
    """What Penumbra shows towards viewers (3, N), (N,), of a sun in a direction (3, 1) or of the lamp."""
    document = scene(
        FLOOR,
        lights=[LAMP if light is None else sun(-light[:, 0], [1, 1, 1])],
        ambient=[0, 0, 0],
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


@SECTION.case(
    "F1: exponent 0",
    symptom="With shininess 0, surfaces flash in full strength where no highlight can be.",
    cause="0 ** 0 is 1 for computers, so the power of a cosine that was clipped to 0 is 1.",
    remedy="The exponent 0 becomes the smallest normal number: 1 for every cosine but 0, and 0 there.",
    expected="0 where r . v <= 0 or the light is below the floor, and the strength itself elsewhere.",
)
def exponent_0() -> Outcome:
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
    return total(_step(*part, quality) for part in parts for quality in BOTH)


def _step(light: Floats | None, viewers: Floats, expected: Any, quality: FixedQuality) -> Outcome:
    """Highlights of the exponent 0 of a sun, or of the lamp where there is none."""
    every = lamp_points() if light is None else [light]

    def plain(dtype: Any) -> Floats:
        return reduce(np.add, (plain_highlights(part, viewers, 0.0, dtype) for part in every)) / len(every)

    found = highlights(light, viewers, 0.0, quality)
    return Outcome(found.size, *(tally(seen != expected) for seen in (found, *in_both(plain))))


@SECTION.case(
    "F2: powers of negative cosines",
    symptom="Black or white specks, NaN in the file, where the mirrored light faces away from the viewer.",
    cause="A negative number has no power with a broken exponent: the result is NaN.",
    remedy="Cosines below 0 become 0 before the power.",
    expected="0 for every cosine below 0, down to -1e-9.",
)
def negative_cosines() -> Outcome:
    """Cosines from -1 to -1e-9, exponents that are not whole; and a lamp of which a part is mirrored away."""
    parts = [_half_mirrored(shininess, quality) for shininess in (0.5, 50.5) for quality in BOTH]
    for number, light in enumerate(lights(6, 7)):
        cosines = -(10 ** np.random.default_rng(number).uniform(-9, 0, 130))
        viewers = away_from(mirrored(light), cosines, number)
        shininess = (0.5, 50.5, 900.1)[number % 3]
        for quality in BOTH:
            found = highlights(light, viewers, shininess, quality)
            with np.errstate(invalid="ignore"):
                plain = plain_cosines(light, viewers, np.float64) ** shininess
            parts.append(Outcome(found.size, tally(found != 0), tally(plain != 0)))
    return total(parts)


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


@SECTION.case(
    "F3: very sharp highlights",
    symptom="Sharp highlights have rings, wrong sizes, or pixels brighter than the light.",
    cause="At the exponent 1e7, one rounding of a float32 cosine near 1 changes the power by 45 %.",
    remedy="Above the exponent 128 cosines are formed in float64, also in single precision.",
    expected="Within 1e-6 of the power to 50 digits for exponents from 1e4 to 1e7, in both precisions, and "
    "never above the strength.",
)
def sharp() -> Outcome:
    """Angles at which the highlight falls from its height to 6e-6 of it."""
    parts = []
    for number, light in enumerate(lights(8, 8)):
        shininess = (1e4, 1e5, 1e6, 1e7)[number % 4]
        fall = np.random.default_rng(number).uniform(0, 12, 70)
        viewers = away_from(mirrored(light), 1 - fall / shininess, number)
        asked = light, viewers, shininess
        true = exact_highlights(*asked)
        parts += [_within(highlights(*asked, quality), true, 1e-6, asked) for quality in BOTH]
    return total(parts)


def _within(found: Floats, true: Floats, share: float, asked: tuple[Floats, Floats, float]) -> Outcome:
    """Answers off by more than a share of the true ones, or above the strength."""

    def errors(values: Floats) -> Floats:
        return np.where(values > STRENGTH, np.inf, np.abs(values - true) / (share * true))

    return judged(errors(found), *map(errors, in_both(partial(plain_highlights, *asked))))


@SECTION.case(
    "F7: straight into the mirrored light",
    symptom="The middle of a highlight is brighter than the light and the material allow.",
    cause="The product of two unit vectors that were rounded is above 1 in about one case of twenty.",
    remedy="Cosines are clipped to 1 before the power.",
    expected="The strength, less at most 16 roundings of the working precision times the exponent; never "
    "more.",
)
def straight() -> Outcome:
    """Viewers exactly in the direction of the mirrored light."""
    parts = []
    for number, light in enumerate(lights(500, 9)[::5]):
        shininess = (1.0, 20.0, 128.0, 1e4, 1e7)[number % 5]
        scales = np.random.default_rng(number).uniform(0.1, 3, 10)
        viewers = mirrored(light) * scales
        quality = BOTH[number // 5 % 2]
        rounding = eps_of(np.float32) if quality is SINGLE and shininess <= 128 else EPS
        asked = light, viewers, shininess
        true = np.full(viewers.shape[1], STRENGTH)
        parts.append(_within(highlights(*asked, quality), true, 16 * rounding * shininess, asked))
    return total(parts)
