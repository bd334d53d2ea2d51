"""Hard cases E: lights in the plane of something, inside of it, beyond it or touching it."""

import itertools
from functools import partial

import numpy as np

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    triangle,
)
from accuracy.hard_cases.harness import (
    DTYPES,
    QUALITIES,
    Outcome,
    Section,
    compiled,
    in_both,
    radiance,
    tally,
    total,
)
from accuracy.hard_cases.shadows.plain import light_hides_itself
from accuracy.hard_cases.shadows.scenes import PATTERNS
from renderer.math.arrays import Floats
from renderer.math.numerics import SURFACE
from schemas.quality import FixedQuality

SECTION = Section("Where lights are")


@SECTION.case(
    "E4: the light's own surface",
    symptom="A lamp lights with a fine grain, as if it were full of holes.",
    cause="A light point is rounded off the lamp's plane, and the shadow ray hits the lamp before its end.",
    remedy="Lights cast no shadow, and a shape in the light's own plane is not between.",
    expected="A lamp set into a ceiling of the same plane is seen whole from 1,000 places, up to 1,000,000 "
    "sizes from the origin.",
)
def own_surface() -> Outcome:
    """A lamp in its ceiling."""
    chosen = np.random.default_rng(3)
    outcomes = []
    for number, offset in enumerate((1.0, 1.0, 1e2, 1e2, 1e4, 1e4, 1e6, 1e6)):
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        corner, down = chosen.normal(size=3) * offset, np.cross(first, second)
        document = scene(
            rectangle(corner - first - second, 3 * first, 3 * second),
            rectangle(corner - 4 * down - 5 * (first + second), 10 * first, 10 * second),
            lights=[lamp(corner, first, second)],
            sampling=sampled(1, 16, light=PATTERNS[number * 3 // 2 % 4]),
        )
        targets = corner - 4 * down + chosen.uniform(-4, 4, (125, 2)) @ np.stack((first, second))
        origins = np.broadcast_to(corner - 2 * down, targets.shape)
        hits = renderer.trace(compiled(document, QUALITIES[number % 2]), origins, targets - origins)
        plain = in_both(partial(light_hides_itself, targets[0], corner, first, second))
        wrong = tally((hits.visibility[:, 0] != 1) | (hits.shape != 1))
        outcomes.append(Outcome(len(targets), wrong, *map(tally, plain)))
    return total(outcomes)


@SECTION.case(
    "E6: a light in the plane of the receiver",
    symptom="A surface beside a lamp that lies in its plane is speckled with light.",
    cause="The cosine is a rounding above or below 0, and its sign decides.",
    remedy="Light within rounding of the horizon gives nothing.",
    expected="Exactly black, in both qualitys.",
)
def coplanar() -> Outcome:
    """A floor, and a lamp and a bulb in its plane."""
    chosen = np.random.default_rng(9)
    outcomes = []
    for number in range(16):
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        up, corner = np.cross(first, second), chosen.normal(size=3)
        document = scene(
            rectangle(corner, first, second),
            sphere(corner + 9 * up, 0.5),
            lights=[
                lamp(corner + 2 * first, first, second, visible=False),
                bulb(corner - first + 0.5 * second),
            ],
            ambient=[0, 0, 0],
            background=[0, 0, 0],
            materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1, specular=1, shininess=0)},
            camera=camera(position=corner + 2 * up, look_at=corner, up=first),
            sampling=sampled(1, 16, light=PATTERNS[number // 2 % 4]),
        )
        image = renderer.render(compiled(document, QUALITIES[number % 2])).image
        points = corner + chosen.uniform(0, 1, (384, 2)) @ np.stack((first, second))
        towards = corner + 2.5 * first + 0.5 * second - points
        plain = (tally(towards.astype(dtype) @ up.astype(dtype) > 0) for dtype in DTYPES)
        outcomes.append(Outcome(384, tally(image.any(axis=2)), *plain))
    return total(outcomes)


@SECTION.case(
    "E9: a light inside an object",
    symptom="A lamp in a closed ball lights the room.",
    cause="Only the first of two hits counts, or the far one is taken to be behind.",
    remedy="Both hits of an ellipsoid count, and those between the ends block.",
    expected="Exactly the ambient term everywhere outside.",
)
def inside() -> Outcome:
    """Bulbs and a lamp in a ball over a floor."""
    outcomes = []
    for quality in QUALITIES:
        bulbs = [bulb([0, 2, 0]), bulb([0.6, 2.5, 0.3]), bulb([0, 1.001, 0])]
        document = scene(
            rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
            sphere([0, 2, 0], 1.0),
            lights=[*bulbs, lamp([-0.2, 2, -0.2], [0.4, 0, 0], [0, 0, 0.4], visible=False)],
            sampling=sampled(1, 16),
        )
        chosen = np.random.default_rng(1)
        targets = np.insert(chosen.uniform(-4, 4, (1000, 2)), 1, 0.0, axis=1)
        origins = targets + np.array([0.0, 0.5, 0])
        hits = renderer.trace(compiled(document, quality), origins, targets - origins)
        on_floor = hits.shape == 0
        outcomes.append(Outcome(tally(on_floor), tally(hits.visibility[on_floor].any(axis=1))))
    return total(outcomes)


@SECTION.case(
    "E11: what is beyond the light or behind the receiver",
    symptom="Things that are not in between cast shadows.",
    cause="The hit on the line is taken without its place on it, or with a bound that is too wide.",
    remedy="Both ends of the segment have to be on different sides of the occluder's plane.",
    expected="The light is seen whole with the occluder a thousandth of the way behind, beyond, or through "
    "it; not at all with the occluder a thousandth before it.",
)
def beyond() -> Outcome:
    """Rectangles and triangles on the line of a bulb."""
    outcomes = []
    receiver = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0])
    for quality, height in itertools.product(QUALITIES, (4.004, 4.0, 3.996, -0.004)):
        seen = 0 if height == 3.996 else 1
        for other in (
            rectangle([-3, -3, height], [6, 0, 0], [0, 6, 0]),
            triangle([-9, -9, height], [9, -9, height], [0, 9, height]),
        ):
            document = scene(receiver, other, lights=[bulb([0, 0, 4])])
            targets = np.insert(np.random.default_rng(2).uniform(-1, 1, (250, 2)), 2, 0.0, axis=1)
            origins = targets * [0.5, 0.5, 0] + np.array([0.0, 0, 1])
            hits = renderer.trace(compiled(document, quality), origins, targets - origins)
            wrong = tally((hits.visibility[:, 0] != seen) | (hits.shape != 0))
            outcomes.append(Outcome(250, wrong))
    return total(outcomes)


@SECTION.case(
    "E5: a light that touches its receiver",
    symptom="Black or white dots, NaN in the file, where a lamp stands on the floor.",
    cause="The square of a short way to the light is 0 or its reciprocal infinite: below 1e-19 in float32, "
    "below 1e-154 in float64.",
    remedy="Ways are scaled by their own length first. With physical falloff, a light point that touches the "
    "place within the rounding of both gives nothing.",
    expected="Down to 1e-300 from the light the cosine to 2^-20, at the contact itself too; with physical "
    "falloff the cosine over the square to 2^-18, or 0 where the two touch. No pixel is NaN or infinite.",
)
def touching() -> Outcome:
    """A bulb just above a floor, a lamp that stands on it, and the picture of both."""
    outcomes = [_pictures()]
    for quality, exponent in itertools.product(QUALITIES, (1, 5, 13, 14, 20, 50, 100, 160, 300)):
        near = 10.0**-exponent
        x, z = near * np.array([[0.0, 0.5, 1, 3], [0, 0.25, 1, 0]])
        light = bulb([0, near, 0], [1, 1, 1])
        away = np.hypot(np.hypot(x, z), near)
        outcomes.append(_lit(light, x, z, quality, near / away, _plain_cosines(x, z, near)))
        seen = _radiance({**light, "falloff": "physical"}, x, z, quality)
        # The floor is formed from numbers that sum up to 16.
        touches = away < SURFACE * 16
        squared = np.where(touches, 0.0, near / away / np.where(touches, 1, away) ** 2)
        outcomes.append(Outcome(x.size, tally(~(np.abs(seen - squared) <= 2.0**-18 * squared))))
        x, z = np.array([0.3, 0.7, 1.0]), near * np.array([1.0, 3.0, 0.0])
        standing = lamp([0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 1, 1], visible=False)
        across, up = (np.arange(4) + 0.5)[:, None, None] / 4, (np.arange(4) + 0.5)[:, None] / 2
        cosines = up / np.hypot(np.hypot(x - across, z), up)
        outcomes.append(_lit(standing, x, z, quality, cosines.mean(axis=(0, 1)), []))
    return total(outcomes)


def _lit(
    light: Json, x: Floats, z: Floats, quality: FixedQuality, cosines: Floats, plain: list[int]
) -> Outcome:
    """Places of a floor whose light is not the cosines (N,)."""
    off = np.abs(_radiance(light, x, z, quality) - cosines)
    return Outcome(x.size, tally(~(off <= 2.0**-20)), *plain)


def _radiance(light: Json, x: Floats, z: Floats, quality: FixedQuality) -> Floats:
    """Radiance (N,) of a white floor at places seen from straight above."""
    ground = rectangle([0, 0, 0], [8, 0, 0], [0, 0, 8])
    white = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}
    document = scene(ground, sphere([4, 9, 4], 1.0), lights=[light], materials=white, sampling=sampled(1, 16))
    zero, one = np.zeros(x.size), np.ones(x.size)
    return radiance(compiled(document, quality), np.stack((x, one, z)), np.stack((zero, -one, zero)))[0]


def _plain_cosines(x: Floats, z: Floats, height: float) -> list[int]:
    """Cosines over the root of the sum of squares that are off, in float64 and in float32."""
    true = height / np.hypot(np.hypot(x, z), height)

    def off(dtype: type[np.floating]) -> int:
        a, b, c = (np.asarray(part, dtype=dtype) for part in (x, height, z))
        return tally(~(np.abs(b / np.sqrt(a * a + b * b + c * c) - true) <= 2.0**-20))

    return in_both(off)


def _pictures() -> Outcome:
    """Pixels (..., 3) that are not finite, with a camera that looks along the line of contact."""
    outcomes = []
    for quality, falloff in itertools.product(QUALITIES, ("none", "physical")):
        standing = lamp([-1, 0, 0], [2, 0, 0], [0, 2, 0], visible=False, falloff=falloff)
        document = scene(
            rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
            sphere([1, 0.5, 0], 0.5),
            lights=[standing, {**bulb([0.25, 0, 1]), "falloff": falloff}],
            camera=camera(position=[0, 0.5, 1], look_at=[0, 0, 0], width=25, height=17),
            materials={"plain": phong(specular=0.5, shininess=900)},
            sampling=sampled(4, 9),
        )
        image = renderer.render(compiled(document, quality)).image
        outcomes.append(Outcome(25 * 17, tally(~np.isfinite(image).all(axis=2))))
    return total(outcomes)
