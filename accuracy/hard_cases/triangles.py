"""Hard cases B: triangles."""

import itertools
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases import flat_shapes, formulas, oracle
from accuracy.hard_cases.documents import mesh, scene, triangle
from accuracy.hard_cases.families import FLAT, FamilyCase
from accuracy.hard_cases.formulas import by_dtype, moeller_trumbore, parts_of, woop
from accuracy.hard_cases.harness import EPS, Outcome, Section, compiled, eps_of, in_both, tally, total, traced
from accuracy.hard_cases.oracle import Answer
from accuracy.hard_cases.scoring import EXCUSED, Textbook, flat_details, rounded, tried
from renderer.math.arrays import Floats, Pairs
from schemas.reading import read_scene

SECTION = Section("Triangles")
WATERTIGHT = "Woop, Benthin, Wald 2013, Watertight ray/triangle intersection"
ROUNDED = (
    "Hit or miss right but within 16 eps of the largest coordinate from the border; t within "
    "8 eps s l / (f c), where s is the largest coordinate, l the longest edge, f the least height and c the "
    "cosine at the normal."
)


def _tried(family: str, textbook: Textbook = formulas.triangle) -> Outcome:
    double = rounded(np.float64)
    return tried(FLAT[family](), textbook, double=double, details=flat_details)


@SECTION.case(
    "B1: triangles without area",
    symptom="Sparks: single bright or dark pixels where a mesh has vertices on one line or in one place.",
    cause="The determinant is nothing but rounding, so dividing by it can say anything.",
    remedy="Whether vertices lie on one line is decided in exact numbers when a scene is compiled; such "
    "triangles are left out, with a warning, or counted.",
    expected="No hit at all, and every such triangle counted, in meshes too.",
    source="geometry; one of the triangles is from a regression test of pbrt-v4",
)
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


@SECTION.case(
    "B2: slivers",
    symptom="Gaps and dots along long thin triangles of a fine mesh.",
    cause="The weights of the vertices lose as many digits as the triangle is thin, and its determinant is "
    "so small that a fixed limit takes it for parallel.",
    remedy="Edge functions in a frame sheared along the ray, in float64, compared with zero.",
    expected=ROUNDED + " Heights of 1e-7 to 1e-2 of the base.",
    source=WATERTIGHT,
)
def slivers() -> Outcome:
    """Heights of 1e-7 to 1e-2."""
    return _tried("slivers", formulas.triangle_with_limit)


@SECTION.case(
    "B3: needles",
    symptom="Needles of a mesh vanish, or are lit from a wrong side.",
    cause="As for slivers, and the product of the two longest edges, nearly parallel, has lost the normal.",
    remedy="The normal is the product of the two shortest edges: close vertices differ by an exact number.",
    expected=ROUNDED + " Normals within 8 eps over the sine of the widest angle.",
    source=WATERTIGHT + "; geometry",
)
def needles() -> Outcome:
    """Two vertices a millionth apart."""
    return _tried("needles", formulas.triangle_with_limit)


@SECTION.case(
    "B4: tiny triangles",
    symptom="Small parts of a scene are missing, or all of it if its unit is large.",
    cause="The determinant grows with the square of the edges; one below 1e-6 is taken for a parallel ray.",
    remedy="No limit that is a length or an area: determinants are compared with zero.",
    expected=ROUNDED + " Sizes of 1e-15 to 1e-4.",
    source="tinybvh, pull request 283; the limit is that of Moeller and Trumbore 1997",
)
def tiny() -> Outcome:
    """Sizes of 1e-15 to 1e-4."""
    return _tried("tiny triangles", formulas.triangle_with_limit)


@SECTION.case(
    "B4: one scene in many units",
    symptom="A scene in millimetres looks different from the same scene in kilometres.",
    cause="Lengths and areas that stand in the code as numbers.",
    remedy="Every comparison is with zero or with a multiple of the numbers it belongs to.",
    expected="Triangles and rays times 2^-40 to 2^40: the same hits and the same t, bit for bit.",
)
def many_units() -> Outcome:
    """Powers of two, which round nothing."""
    family = itertools.islice(FLAT["triangles"](), 25)
    return flat_shapes.scaled(family, formulas.triangle_with_limit)


@SECTION.case(
    "B5: huge triangles",
    symptom="Far terrain is full of holes or NaN.",
    cause="Products of three coordinates overflow float32, and infinity over infinity is NaN.",
    remedy="Rays intersect shapes in float64, and scenes refuse coordinates beyond 1e15.",
    expected=ROUNDED + " Coordinates up to 1e15.",
)
def huge() -> Outcome:
    """Coordinates up to 1e15."""
    return _tried("huge triangles")


@SECTION.case(
    "B15: triangles far from the origin",
    symptom="A model that was moved far away jitters, with steps in its depth.",
    cause="Coordinates of a million have few digits left for what is one unit wide in float32.",
    remedy="Vertices are taken relative to the ray's origin before anything else, in float64.",
    expected=ROUNDED + " A million units away.",
    source=WATERTIGHT,
)
def far_away() -> Outcome:
    """One unit wide, a million away."""
    return _tried("triangles far from the origin")


@SECTION.case(
    "B6: rays at a shared edge",
    symptom="Pinholes along the edges of a mesh, through which the background shines.",
    cause="Each triangle rounds its own weights, and both may say that the ray is on the other's side.",
    remedy="Each vertex is sheared alike for all its triangles, and an edge function x1 y2 - y1 x2 only "
    "changes its sign from one neighbour to the other; the border belongs to the triangle.",
    expected="No ray passes between two triangles.",
    source=WATERTIGHT,
)
def shared_edges() -> Outcome:
    """Pairs of triangles."""
    return flat_shapes.leaks(flat_shapes.pairs_of_triangles(), formulas.moeller_trumbore)


@SECTION.case(
    "B6: rays exactly at a shared edge",
    symptom="Pinholes in regular grids, where rays hit edges exactly.",
    cause="On the edge both weights are zero in truth, and their rounding has any sign.",
    remedy="As for all shared edges: the two roundings are the same but for the sign, and zero is inside.",
    expected="No ray passes between two triangles of whole numbers.",
    source=WATERTIGHT,
)
def exactly_at_edges() -> Outcome:
    """Pairs of triangles, edges and rays of whole numbers."""
    return flat_shapes.leaks(flat_shapes.pairs_in_whole_numbers(), formulas.moeller_trumbore)


@SECTION.case(
    "B7: rays at a shared vertex",
    symptom="Pinholes at the vertices of a mesh.",
    cause="As at edges, with six triangles that all have to miss.",
    remedy="As at edges.",
    expected="No ray passes through the tip of a fan of six triangles.",
    source=WATERTIGHT + "; Embree, issues 174, 181 and 188",
)
def shared_vertices() -> Outcome:
    """Fans of six triangles."""
    return flat_shapes.leaks(flat_shapes.fans(), formulas.moeller_trumbore)


@SECTION.case(
    "B8: a closed mesh, near and far",
    symptom="Light dots on a closed surface, more of them far from the origin.",
    cause="Leaks at edges and vertices, on a coarser grid of coordinates.",
    remedy="The same watertight test behind every leaf of the tree, whose boxes are wider than its rounding.",
    expected="A sphere of 960 triangles at the origin and at (148376, 1234, -223423): of 15,000 rays from "
    "inside at faces, edges and vertices, each hits a triangle next to its target.",
    source=WATERTIGHT + "; Embree's verify, which tolerates 2e-5",
)
def closed_mesh() -> Outcome:
    """One mesh."""
    places = ((0.0, 0.0, 0.0), flat_shapes.FAR)
    return total(flat_shapes.sphere(place, "mesh", formulas.moeller_trumbore) for place in places)


@SECTION.case(
    "B8: a closed surface of single triangles, near and far",
    symptom="As for a mesh, where a scene lists its triangles one by one.",
    cause="As for a mesh. The place where the ray hits the plane is rounded, and judged by each edge alone.",
    remedy="Triangles of a scene are intersected as those of meshes are.",
    expected="As for the mesh, with the same sphere.",
    source=WATERTIGHT,
)
def closed_surface() -> Outcome:
    """One shape a triangle."""
    places = ((0.0, 0.0, 0.0), flat_shapes.FAR)
    return total(flat_shapes.sphere(place, "triangle", formulas.plane_and_sides) for place in places)


@SECTION.case(
    "B9, B10: rays along a triangle's plane",
    symptom="NaN pixels, or a ghost of the triangle very far away, when the camera looks along a floor.",
    cause="The determinant is 0; in the plane all quotients are 0/0, and no comparison sorts NaN out.",
    remedy="A hit needs an edge function other than zero, and t is a mean of the vertices' depths.",
    expected="A miss beside the plane; in it a miss, or a hit where the ray passes the triangle. Never NaN.",
    source=WATERTIGHT + "; geometry",
)
def along_the_plane() -> Outcome:
    """Beside it and in it, in whole numbers."""
    return flat_shapes.along_the_plane("triangle")


@SECTION.case(
    "B11: triangles at a grazing angle",
    symptom="Noise in the depth of surfaces seen almost edge-on; parts of them missing.",
    cause="t is divided by a cosine that has lost its digits, or a fixed limit takes the ray for parallel.",
    remedy="t is a mean of the vertices' depths by weight, so it never leaves the triangle's range.",
    expected=ROUNDED + " Angles down to 3e-7.",
    source=WATERTIGHT,
)
def grazing() -> Outcome:
    """Angles down to 3e-7."""
    return _tried("triangles at a grazing angle", formulas.triangle_with_limit)


@SECTION.case(
    "B12: points far from the camera",
    symptom="Shadows and textures flicker on what is far away, in steps that grow with the distance.",
    cause="The point o + t d is rounded in steps of t, not of the triangle's own coordinates.",
    remedy="Points are formed from the vertices, by weight.",
    expected="From 1e3 to 3e6 units away: within 8 eps of the largest vertex coordinate from the plane.",
    source="pbrt-v4, Triangle::Intersect",
)
def long_rays() -> Outcome:
    """Places from 1e3 to 3e6 units away."""
    return total([_tried("long rays"), *map(_off_the_plane, FLAT["long rays"]())])


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


@SECTION.case(
    "B14: hits close to what their error allows",
    symptom="Thin triangles disappear in a renderer that bounds its errors.",
    cause="A bound on the error of t that adds up all that could go wrong exceeds t itself in slivers, "
    "needles and at long distances; in float64 it takes thinner ones.",
    remedy="A camera ray's hit counts unless rounding alone could have put the origin on the triangle; wider "
    "bounds are for rays that leave a surface.",
    expected="Every hit of a sliver, a needle or a long ray is kept.",
    source="pbrt-v4, Triangle::Intersect (its bound, tried with and without)",
)
def bounds_that_bite() -> Outcome:
    """Slivers, needles and long rays."""
    names = ("slivers", "needles", "long rays")
    return total(_dropped(case) for name in names for case in FLAT[name]())


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


@SECTION.case(
    "B13: rays that start on a triangle",
    symptom="Mirrors and shadows with specks: a surface hits itself.",
    cause="The distance of a start on the plane from the plane is a sum that rounds to 1e-16 instead of 0.",
    remedy="A hit nearer than the rounding of its own sum is a start on the triangle.",
    expected="No hit. Starts are eighths of edges of whole numbers, exactly on the plane.",
)
def from_the_plane() -> Outcome:
    """In whole numbers."""
    return flat_shapes.from_the_plane("triangle")
