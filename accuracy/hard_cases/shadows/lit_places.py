"""Hard cases E: how much of a light a place gets, at and below horizons and under edges."""

import itertools
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
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
    QUALITIES,
    Outcome,
    Section,
    compiled,
    in_both,
    judged,
    points,
    radiance,
    tally,
    total,
)
from accuracy.hard_cases.shadows.scenes import PATTERNS, Place, grid, places
from renderer.math.arrays import Floats
from schemas.quality import FixedQuality

SECTION = Section("Lit places")

WHITE = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}


@SECTION.case(
    "E7: a light below the horizon",
    symptom="A scene with many lights takes as long as if every place saw all of them.",
    cause="A shadow ray is sent first, and then found to belong to a light that the surface faces away from.",
    remedy="Places that face away from a light, or lie behind a light of one side, are left out before any "
    "shadow is asked for.",
    expected="No shadow ray is counted, and the picture has the bytes of the one without lights.",
)
def below_the_horizon() -> Outcome:
    """A floor over lights of all kinds, and under a lamp that shines upwards at a ball."""
    outcomes = []
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
        outcomes.append(Outcome(pairs, changed + asked.report["rays"]["shadow"]))
    return total(outcomes)


def _report(lights: list[Json], quality: FixedQuality, pattern: str) -> renderer.RenderResult:
    document = scene(
        rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0]),
        sphere([0, 6, 0], 1.0),
        lights=lights,
        camera=camera(position=[0, 2, 0.5], look_at=[0, 0, 0]),
        sampling=sampled(1, 9, light=pattern),
    )
    return renderer.render(compiled(document, quality))


@SECTION.case(
    "E12: the terminator of a coarse mesh",
    symptom="Facets of a smooth mesh that face away from a light are lit, with a jagged border.",
    cause="The normal that a mesh is shaded with still faces a light that is behind the true surface.",
    remedy="A light point counts only if it is above the horizon of the true normal; how bright it is, the "
    "shading normal says.",
    expected="Exactly 0 where the light is behind the facet; elsewhere, where nothing is in between, the "
    "cosine with the shading normal to 2^-20.",
    source="geometry; Woo, Pearce and Ouellette 1996, It's really not a rendering bug, you see",
)
def terminator() -> Outcome:
    """A smooth mesh of hills of few facets, with a sun 10 degrees above it."""
    outcomes = []
    for number, (chosen, place) in enumerate(places("terminator", offsets=(0.0, 1e2, 1e4, 1e6), turns=2)):
        steps = np.linspace(-2, 2, 7)
        x, y = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
        vertices, faces = grid(place, steps, 0.4 * np.sin(2.1 * x) * np.cos(1.7 * y))
        towards = place.way(np.cos(np.pi / 18), 0, np.sin(np.pi / 18))
        hills = mesh(vertices, faces, smooth=True)
        document = scene(hills, lights=[sun(-towards, [1, 1, 1])], materials=WHITE, ambient=[0, 0, 0])
        targets = place.at(*chosen.uniform(-1.9, 1.9, (2, 200)), 0)
        outcomes.append(_at_terminator(document, targets, place, towards, QUALITIES[number % 2]))
    return total([*outcomes, _leaning(), *(_half_below(quality) for quality in QUALITIES)])


def _half_below(quality: FixedQuality) -> Outcome:
    """A triangle whose normals lean towards a lamp, half of which is below its horizon."""
    leaning = triangle([-2, 0, 2], [2, 0, 2], [0, 0, -3], normals=[[1, 0.2, 0]] * 3)
    light = lamp([4, -1, -1], [0, 2, 0], [0, 0, 2], [1, 1, 1], visible=False)
    document = scene(
        leaning,
        sphere([0, 30, 0], 1.0),
        lights=[light],
        materials=WHITE,
        ambient=[0, 0, 0],
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
    document = scene(
        triangle([-2, 0, 2], [2, 0, 2], [0, 0, -3], normals=[[1, 0.2, 0]] * 3),
        sphere([0, 30, 0], 1.0),
        lights=[
            bulb([5, -0.5, 0]),
            sun([-1, 0.1, 0]),
            lamp([4, -1, -1], [0, 0.9, 0], [0, 0, 2], visible=False),
        ],
        materials=WHITE,
        ambient=[0, 0, 0],
        background=[0, 0, 0],
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
    met, seen = points(plan, *rays), radiance(plan, *rays)[0]
    visible = renderer.trace(plan, origins, targets - origins).visibility[:, 0]
    true, shading = towards @ met.normals, towards @ met.shading_normals
    expected = np.where(true > 0, np.maximum(shading, 0.0), 0.0) * visible
    wrong = np.where(true > 0, np.abs(seen - expected) > 2.0**-20, seen != 0)
    return Outcome(true.size, tally(wrong), tally((shading > 0) & (true <= 0)))


@SECTION.case(
    "E13: a light that is half covered",
    symptom="The half-shadow of a lamp is too wide or too dark by a part of a light point, or has steps.",
    cause="Light points at the corners of a grid's cells instead of their middles, and the same for every "
    "place, are a little off the light.",
    remedy="A grid's points are the middles of its cells; drawn points are drawn anew for every place.",
    expected="The share that geometry says: within half a cell for a grid, a cell for one drawn in each "
    "cell, 1/N for a Sobol sequence of N points, and for N drawn points within 5 standard deviations at each "
    "of 500 places (by chance wrong once in 3,500 trials) and 4 in their mean (once in 16,000).",
    source="geometry; Shirley 1991, Discrepancy as a quality measure for sample distributions",
)
def half_covered() -> Outcome:
    """A lamp above the edge of a screen, a rectangle or two triangles, halfway to the floor."""
    return total(_half_covered(*each) for each in itertools.product(PATTERNS, QUALITIES))


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
