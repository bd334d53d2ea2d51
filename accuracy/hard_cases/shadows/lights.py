"""Hard cases E: where lights are, and how much of them a place gets at horizons and under edges."""

import itertools
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    dark_scene,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from accuracy.hard_cases.harness import (
    DTYPES,
    QUALITIES,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    in_both,
    judged,
    points,
    radiance,
    tally,
)
from accuracy.hard_cases.shadows.plain import light_hides_itself
from accuracy.hard_cases.shadows.scenes import PATTERNS, Place, grid, places
from renderer.math.arrays import Floats
from renderer.math.numerics import SURFACE
from schemas.quality import FixedQuality


def own_surface() -> Iterator[Outcomes]:
    """A lamp in its ceiling."""
    chosen = np.random.default_rng(3)
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
        yield Outcome(len(targets), wrong, *map(tally, plain))


def coplanar() -> Iterator[Outcomes]:
    """A floor, and a lamp and a bulb in its plane."""
    chosen = np.random.default_rng(9)
    for number in range(16):
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        up, corner = np.cross(first, second), chosen.normal(size=3)
        document = dark_scene(
            rectangle(corner, first, second),
            sphere(corner + 9 * up, 0.5),
            lights=[
                lamp(corner + 2 * first, first, second, visible=False),
                bulb(corner - first + 0.5 * second),
            ],
            materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1, specular=1, shininess=0)},
            camera=camera(position=corner + 2 * up, look_at=corner, up=first),
            sampling=sampled(1, 16, light=PATTERNS[number // 2 % 4]),
        )
        image = renderer.render(compiled(document, QUALITIES[number % 2])).image
        points = corner + chosen.uniform(0, 1, (384, 2)) @ np.stack((first, second))
        towards = corner + 2.5 * first + 0.5 * second - points
        plain = (tally(towards.astype(dtype) @ up.astype(dtype) > 0) for dtype in DTYPES)
        yield Outcome(384, tally(image.any(axis=2)), *plain)


def inside() -> Iterator[Outcomes]:
    """Bulbs and a lamp in a ball over a floor."""
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
        yield Outcome(tally(on_floor), tally(hits.visibility[on_floor].any(axis=1)))


def beyond() -> Iterator[Outcomes]:
    """Rectangles and triangles on the line of a bulb."""
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
            yield Outcome(250, wrong)


def touching() -> Iterator[Outcomes]:
    """A bulb just above a floor, a lamp that stands on it, and the picture of both."""
    yield _pictures()
    for quality, exponent in itertools.product(QUALITIES, (1, 5, 13, 14, 20, 50, 100, 160, 300)):
        near = 10.0**-exponent
        x, z = near * np.array([[0.0, 0.5, 1, 3], [0, 0.25, 1, 0]])
        light = bulb([0, near, 0], [1, 1, 1])
        away = np.hypot(np.hypot(x, z), near)
        yield _lit(light, x, z, quality, near / away, _plain_cosines(x, z, near))
        seen = _radiance({**light, "falloff": "physical"}, x, z, quality)
        # The floor is formed from numbers that sum up to 16.
        touches = away < SURFACE * 16
        squared = np.where(touches, 0.0, near / away / np.where(touches, 1, away) ** 2)
        yield Outcome(x.size, tally(~(np.abs(seen - squared) <= 2.0**-18 * squared)))
        x, z = np.array([0.3, 0.7, 1.0]), near * np.array([1.0, 3.0, 0.0])
        standing = lamp([0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 1, 1], visible=False)
        across, up = (np.arange(4) + 0.5)[:, None, None] / 4, (np.arange(4) + 0.5)[:, None] / 2
        cosines = up / np.hypot(np.hypot(x - across, z), up)
        yield _lit(standing, x, z, quality, cosines.mean(axis=(0, 1)), [])


def _lit(
    light: Json, x: Floats, z: Floats, quality: FixedQuality, cosines: Floats, plain: list[int]
) -> Outcome:
    """Places of a floor whose light is not the cosines (N,)."""
    off = np.abs(_radiance(light, x, z, quality) - cosines)
    return Outcome(x.size, tally(~(off <= 2.0**-20)), *plain)


def _radiance(light: Json, x: Floats, z: Floats, quality: FixedQuality) -> Floats:
    """Radiance (N,) of a white floor at places seen from straight above."""
    ground = rectangle([0, 0, 0], [8, 0, 0], [0, 0, 8])
    document = dark_scene(ground, sphere([4, 9, 4], 1.0), lights=[light], sampling=sampled(1, 16))
    zero, one = np.zeros(x.size), np.ones(x.size)
    return radiance(compiled(document, quality), np.stack((x, one, z)), np.stack((zero, -one, zero)))[0]


def _plain_cosines(x: Floats, z: Floats, height: float) -> list[int]:
    """Cosines over the root of the sum of squares that are off, in float64 and in float32."""
    true = height / np.hypot(np.hypot(x, z), height)

    def off(dtype: type[np.floating]) -> int:
        a, b, c = (np.asarray(part, dtype=dtype) for part in (x, height, z))
        return tally(~(np.abs(b / np.sqrt(a * a + b * b + c * c) - true) <= 2.0**-20))

    return in_both(off)


def _pictures() -> Iterator[Outcomes]:
    """Pixels (..., 3) that are not finite, with a camera that looks along the line of contact."""
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
        yield Outcome(25 * 17, tally(~np.isfinite(image).all(axis=2)))


def below_the_horizon() -> Iterator[Outcomes]:
    """A floor over lights of all kinds, and under a lamp that shines upwards at a ball."""
    for quality, pattern in itertools.product(QUALITIES, PATTERNS):
        shining = [
            bulb([0.5, -1, 0]),
            sun([0.2, 1, 0.1]),
            lamp([-1, -2, -1], [2, 0, 0], [0, 0.5, 2], visible=False),
            lamp([-1, 3, -1], [0, 0, 2], [2, 0, 0], visible=False, two_sided=False),
        ]
        dark, asked = (_report(lights, quality, pattern) for lights in ([], shining))
        changed = tally((dark.image != asked.image).any(axis=2))
        pairs = dark.image[..., 0].size * len(shining)
        yield Outcome(pairs, changed + asked.report["rays"]["shadow"])


def _report(lights: list[Json], quality: FixedQuality, pattern: str) -> renderer.RenderResult:
    document = scene(
        rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0]),
        sphere([0, 6, 0], 1.0),
        lights=lights,
        camera=camera(position=[0, 2, 0.5], look_at=[0, 0, 0]),
        sampling=sampled(1, 9, light=pattern),
    )
    return renderer.render(compiled(document, quality))


def terminator() -> Iterator[Outcomes]:
    """A smooth mesh of hills of few facets, with a sun 10 degrees above it."""
    for number, (chosen, place) in enumerate(places("terminator", offsets=(0.0, 1e2, 1e4, 1e6), turns=2)):
        steps = np.linspace(-2, 2, 7)
        x, y = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
        vertices, faces = grid(place, steps, 0.4 * np.sin(2.1 * x) * np.cos(1.7 * y))
        towards = place.way(np.cos(np.pi / 18), 0, np.sin(np.pi / 18))
        hills = mesh(vertices, faces, smooth=True)
        document = dark_scene(hills, lights=[sun(-towards, [1, 1, 1])])
        targets = place.at(*chosen.uniform(-1.9, 1.9, (2, 200)), 0)
        yield _at_terminator(document, targets, place, towards, QUALITIES[number % 2])
    yield _leaning()
    yield (_half_below(quality) for quality in QUALITIES)


def _half_below(quality: FixedQuality) -> Outcome:
    """A triangle whose normals lean towards a lamp, half of which is below its horizon."""
    leaning = triangle([-2, 0, 2], [2, 0, 2], [0, 0, -3], normals=[[1, 0.2, 0]] * 3)
    light = lamp([4, -1, -1], [0, 2, 0], [0, 0, 2], [1, 1, 1], visible=False)
    document = dark_scene(
        leaning,
        sphere([0, 30, 0], 1.0),
        lights=[light],
        sampling=sampled(1, 16),
    )
    x, z = np.random.default_rng(12).uniform(-0.5, 0.5, (2, 100))
    zero, one = np.zeros(100), np.ones(100)
    seen = radiance(compiled(document, quality), np.stack((x, one, z)), np.stack((zero, -one, zero)))[0]
    up, along = (part.ravel()[:, None] for part in np.meshgrid(*[(np.arange(4) + 0.5) / 2 - 1] * 2))
    cosines = ((4 - x) + 0.2 * up) / np.sqrt(1.04 * ((4 - x) ** 2 + up**2 + (along - z) ** 2))
    expected = np.where(up > 0, cosines, 0.0)
    off, plain = (np.abs(part - expected.mean(axis=0)) * 2.0**20 for part in (seen, cosines.mean(axis=0)))
    return judged(off, plain)


def _leaning() -> Outcome:
    """A triangle whose normals lean towards lights of all kinds below its horizon."""
    document = dark_scene(
        triangle([-2, 0, 2], [2, 0, 2], [0, 0, -3], normals=[[1, 0.2, 0]] * 3),
        sphere([0, 30, 0], 1.0),
        lights=[
            bulb([5, -0.5, 0]),
            sun([-1, 0.1, 0]),
            lamp([4, -1, -1], [0, 0.9, 0], [0, 0, 2], visible=False),
        ],
        sampling=sampled(1, 9),
    )
    images = [renderer.render(compiled(document, quality)).image for quality in QUALITIES]
    lit = sum(tally(image.any(axis=2)) for image in images)
    return Outcome(2 * images[0][..., 0].size, lit)


def _at_terminator(
    document: Json, targets: Floats, place: Place, towards: Floats, quality: FixedQuality
) -> Outcome:
    plan = compiled(document, quality)
    origins = targets + place.way(0, 0, 9)
    rays = np.ascontiguousarray(origins.T), np.ascontiguousarray((targets - origins).T)
    floor_points, seen = points(plan, *rays), radiance(plan, *rays)[0]
    visible = renderer.trace(plan, origins, targets - origins).visibility[:, 0]
    true, shading = towards @ floor_points.normals, towards @ floor_points.shading_normals
    expected = np.where(true > 0, np.maximum(shading, 0.0), 0.0) * visible
    wrong = np.where(true > 0, np.abs(seen - expected) > 2.0**-20, seen != 0)
    return Outcome(true.size, tally(wrong), tally((shading > 0) & (true <= 0)))


SIDE = 16
"""Light points are SIDE x SIDE."""


def _half_covered(pattern: str, quality: FixedQuality) -> Outcome:
    floor = rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0])
    if quality is QUALITIES[0]:
        screen = [rectangle([0, 1, -9], [9, 0, 0], [0, 0, 18])]
    else:
        screen = [triangle([0, 1, -9], [9, 1, -9], [9, 1, 9]), triangle([0, 1, -9], [9, 1, 9], [0, 1, 9])]
    above = lamp([-1, 2, -1], [2, 0, 0], [0, 0, 2])
    document = scene(floor, *screen, lights=[above], sampling=sampled(1, SIDE * SIDE, light=pattern))
    chosen = np.random.default_rng(11)
    targets = np.insert(chosen.uniform(-1, 1, (500, 2)), 1, 0.0, axis=1)
    origins = targets + np.array([-0.25, 0.5, 0])
    hits = renderer.trace(compiled(document, quality), origins, targets - origins)
    # The way from x to a light point at y passes the screen's edge where x + y = 0.
    x = hits.position[:, 0]
    share = (1 - x) / 2
    off = hits.visibility[:, 0] - share
    spread = np.sqrt(share * (1 - share)) / SIDE
    allowed = {
        "uniform": np.full(500, 0.5 / SIDE),
        "stratified": np.full(500, 1 / SIDE),
        "sobol": np.full(500, 1 / SIDE**2),
        "random": 5 * spread,
    }[pattern]
    # Single quality moves an edge by some 2^-21 of the light.
    wrong = tally(~(np.abs(off) <= allowed + 2.0**-20))
    if pattern == "random":
        wrong += bool(abs(off.mean()) > 4 * np.sqrt((spread**2).sum()) / 500)
    corners = in_both(partial(_corners_of_cells, x))
    return Outcome(501, wrong, *(tally(np.abs(each - share) > 0.5 / SIDE) for each in corners))


def _corners_of_cells(x: Floats, dtype: Any) -> Floats:
    """Share of the lamp seen from places x (N,) by light points at the corners of a grid's cells."""
    across = (-1 + 2 * np.arange(SIDE) / SIDE).astype(dtype)
    return (x.astype(dtype)[:, None] + across < 0).mean(axis=1)


CASES: Cases = {
    "E4: the light's own surface": own_surface,
    "E6: a light in the plane of the receiver": coplanar,
    "E9: a light inside an object": inside,
    "E11: what is beyond the light or behind the receiver": beyond,
    "E5: a light that touches its receiver": touching,
    "E7: a light below the horizon": below_the_horizon,
    "E12: the terminator of a coarse mesh": terminator,
    "E13: a light that is half covered": lambda: (
        _half_covered(*each) for each in itertools.product(PATTERNS, QUALITIES)
    ),
}
