"""Hard cases B: triangles."""

import itertools
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases import flat_shapes as flat
from accuracy.hard_cases import formulas, oracle
from accuracy.hard_cases.documents import mesh, scene, triangle
from accuracy.hard_cases.families import FLAT, FamilyCase
from accuracy.hard_cases.formulas import by_dtype, moeller_trumbore, parts_of, woop
from accuracy.hard_cases.harness import EPS, Cases, Outcome, compiled, eps_of, in_both, tally, traced
from accuracy.hard_cases.oracle import Answer
from accuracy.hard_cases.scoring import EXCUSED
from renderer.math.arrays import Floats, Pairs
from schemas.reading import read_scene


def without_area() -> Outcome:
    """1,000 rays at 100 triangles on lines or in a point, as shapes and as a mesh, and one that pbrt hit."""
    corners, origins, targets = on_lines()
    origins = np.concatenate((origins, [REGRESSION_RAY[0]]))
    directions = np.concatenate((targets - origins[:-1], [REGRESSION_RAY[1]]))
    everything = np.concatenate((corners, [REGRESSION]))
    together = mesh(everything.reshape(-1, 3), np.arange(3 * len(everything)).reshape(-1, 3))
    plan = compiled(scene(together, *(triangle(*rows) for rows in everything.tolist())))
    uncounted = abs(2 * len(everything) - plan.numerics["degenerate_dropped"])
    hit = tally(renderer.trace(plan, origins, directions).shape >= 0)
    owners = everything[np.append(np.repeat(np.arange(100), 10), 100)]
    plain = by_dtype(moeller_trumbore, list(owners.transpose(1, 0, 2)), origins, directions)
    return Outcome(len(origins), hit + uncounted, *(tally(~np.isinf(t)) for t in plain))


REGRESSION = [
    [-1113.45459, -79.049614, -56.2431908],
    [-1113.45459, -87.0922699, -56.2431908],
    [-1113.45459, -79.2090149, -56.2431908],
]
"""On one line; pbrt-v4 once reported a hit."""

REGRESSION_RAY = ([-1081.47925, 99.9999542, 87.7701111], [-32.1072998, -183.355865, -144.607635])
"""The ray that did."""


def on_lines() -> tuple[Floats, Floats, Floats]:
    """Triangles (100, 3, 3) exactly on lines, and ten rays at each, (1000, 3).

    Half of whole numbers in many units, every tenth a point; half of doubles times powers of two: these lie
    on a line through the origin, but their differences are rounded.
    """
    rng = np.random.default_rng(1)
    unit = 2.0 ** rng.integers(-20, 20, (100, 1, 1))
    starts, ways = rng.integers(-20, 21, (2, 100, 1, 3)).astype(float)
    steps = rng.integers(-9, 10, (100, 3, 1)).astype(float)
    steps[::10] = steps[::10, :1]
    starts[1::2] = 0
    ways[1::2] = rng.normal(size=(50, 1, 3))
    steps[1::2] = rng.choice([-1, 1], (50, 3, 1)) * 2.0 ** rng.integers(0, 5, (50, 3, 1))
    targets = (starts + rng.uniform(-9, 9, (100, 10, 1)) * ways) * unit
    origins = targets + rng.normal(size=(100, 10, 3)) * 100 * unit
    return (starts + steps * ways) * unit, origins.reshape(-1, 3), targets.reshape(-1, 3)


def _off_the_plane(case: FamilyCase) -> Outcome:
    """Hits whose point is off the exact plane by more than 8 eps of the largest coordinate of a vertex."""
    shape, true, origins, directions = asked(case)

    def along_the_ray(dtype: type[np.floating]) -> Pairs:
        start, along = origins.astype(dtype), directions.astype(dtype)
        return np.asarray(start + formulas.triangle(shape, start, along)[:, None] * along)

    found = traced([case[0]], origins, directions).position
    counts = []
    for places in (found, *in_both(along_the_ray)):
        allowed = 8 * eps_of(places.dtype.type) * float(np.abs(shape.vertices).max())
        rows = zip(places.astype(float), true, strict=True)
        with np.errstate(invalid="ignore"):
            heights = [np.dot(place - each.position, each.normal) for place, each in rows if each.hit]
        counts.append(tally(~(np.abs(heights) <= allowed)))
    return Outcome(len(heights), *counts)


def asked(case: FamilyCase) -> tuple[Any, list[Answer], Floats, Floats]:
    """The shape of a case as it is read, the exact answers, and origins and directions (N, 3) of the rays."""
    document, rays = case
    shape = read_scene(scene(document))[0].shapes[0]
    origins, directions = np.array(rays).transpose(1, 0, 2)
    return shape, [oracle.answer(shape, *ray) for ray in rays], origins, directions


def _dropped(case: FamilyCase) -> Outcome:
    """True hits that Woop's test finds, and loses with the bound on the error of t."""
    shape, true, origins, directions = asked(case)
    # Within roundings of the border a miss is right too.
    sure = np.array([answer.hit and answer.margin > EXCUSED * EPS for answer in true])
    lost = sure & np.isinf(traced([case[0]], origins, directions).t)
    vertices = list(parts_of(shape))
    free, bounded = (
        by_dtype(partial(woop, bounded=bound), vertices, origins, directions) for bound in (False, True)
    )
    kept = zip(free, bounded, strict=True)
    return Outcome(tally(sure), tally(lost), *(tally(sure & np.isfinite(a) & np.isinf(b)) for a, b in kept))


CASES: Cases = {
    "B1: triangles without area": without_area,
    "B2: slivers": lambda: flat.tried("slivers", formulas.triangle_with_limit),
    "B3: needles": lambda: flat.tried("needles", formulas.triangle_with_limit),
    "B4: tiny triangles": lambda: flat.tried("tiny triangles", formulas.triangle_with_limit),
    "B4: one scene in many units": lambda: flat.scaled(
        itertools.islice(FLAT["triangles"](), 25), formulas.triangle_with_limit
    ),
    "B5: huge triangles": lambda: flat.tried("huge triangles", formulas.triangle),
    "B15: triangles far from the origin": lambda: flat.tried(
        "triangles far from the origin", formulas.triangle
    ),
    "B6: rays at a shared edge": lambda: flat.leaks(flat.pairs_of_triangles(), formulas.moeller_trumbore),
    "B6: rays exactly at a shared edge": lambda: flat.leaks(
        flat.pairs_in_whole_numbers(), formulas.moeller_trumbore
    ),
    "B7: rays at a shared vertex": lambda: flat.leaks(flat.fans(), formulas.moeller_trumbore),
    "B8: a closed mesh, near and far": lambda: (
        flat.sphere(place, "mesh", formulas.moeller_trumbore) for place in ((0.0, 0.0, 0.0), flat.FAR)
    ),
    "B8: a closed surface of single triangles, near and far": lambda: (
        flat.sphere(place, "triangle", formulas.plane_and_sides) for place in ((0.0, 0.0, 0.0), flat.FAR)
    ),
    "B9, B10: rays along a triangle's plane": lambda: flat.along_the_plane("triangle"),
    "B11: triangles at a grazing angle": lambda: flat.tried(
        "triangles at a grazing angle", formulas.triangle_with_limit
    ),
    "B12: points far from the camera": lambda: [
        flat.tried("long rays", formulas.triangle),
        *map(_off_the_plane, FLAT["long rays"]()),
    ],
    "B14: hits close to what their error allows": lambda: (
        _dropped(case) for name in ("slivers", "needles", "long rays") for case in FLAT[name]()
    ),
    "B13: rays that start on a triangle": lambda: flat.from_the_plane("triangle"),
}
