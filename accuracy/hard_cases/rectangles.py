"""Hard cases C: rectangles."""

import itertools

import numpy as np

from accuracy.hard_cases import flat_shapes, formulas
from accuracy.hard_cases.documents import rectangle, scene
from accuracy.hard_cases.families import FLAT
from accuracy.hard_cases.formulas import by_dtype, projected_on_edges
from accuracy.hard_cases.harness import Outcome, Section, rays_of, refused_at, tally, total
from accuracy.hard_cases.scoring import Textbook, flat_details, rounded, tried
from renderer.shapes.rectangles import from_edges

SECTION = Section("Rectangles")
CORNER_TEST = "geometry (triple products of corner, edges and ray)"
ROUNDED = (
    "Hit or miss right but within 16 eps of the largest coordinate from the border; t within 8 eps s / c, "
    "where s is the largest coordinate and c the cosine at the normal."
)


def _tried(family: str, textbook: Textbook = formulas.rectangle) -> Outcome:
    double = rounded(np.float64)
    return tried(FLAT[family](), textbook, double=double, details=flat_details)


@SECTION.case(
    "C1: edges that are not perpendicular",
    symptom="A sheared wall has the outline of another shape.",
    cause="Projection on the edges, u = q . e1 / |e1|^2, is right for perpendicular edges alone.",
    remedy="u and v are quotients of triple products, which hold for any two edges.",
    expected=ROUNDED,
    source=CORNER_TEST,
)
def skew() -> Outcome:
    """Edges at any angle."""
    return _tried("skew parallelograms")


@SECTION.case(
    "C2: corners of a room",
    symptom="A line of light along the corner of two walls.",
    cause="Perpendicular edges rounded to float32 are off by 1e-8, so projection moves the border by that, "
    "and the two walls differently.",
    remedy="Triple products, and a border as wide as its own rounding.",
    expected="Two walls with one corner and one edge in common let no ray through, at any angle.",
    source=CORNER_TEST,
)
def corners_of_rooms() -> Outcome:
    """Walls perpendicular as float32 says, and walls at any angle."""
    surfaces = itertools.chain(flat_shapes.corners_of_rooms(), flat_shapes.skew_corners())
    return flat_shapes.leaks(surfaces, formulas.projected_on_edges)


@SECTION.case(
    "C9: edges that agree but for rounding",
    symptom="A turned box leaks light along its edges.",
    cause="Centre, normal, tangent and size give the corners of neighbours with different roundings; "
    "even exact borders leave a gap between them.",
    remedy="The border of a rectangle is as wide as the rounding of its corner and of the ray.",
    expected="Boxes of six rectangles by their centres let no ray out, near the origin and far from it.",
    source=CORNER_TEST,
)
def turned_boxes() -> Outcome:
    """Every edge and corner of turned boxes, from inside."""
    return flat_shapes.leaks(flat_shapes.turned_boxes(), formulas.closed_parallelogram)


@SECTION.case(
    "C3: rectangles at a grazing angle",
    symptom="A floor or a wall seen edge-on vanishes.",
    cause="A fixed limit, |d . n| < 1e-6, takes the ray for parallel.",
    remedy="d . n is compared with zero.",
    expected=ROUNDED + " Angles down to 3e-7.",
    source=CORNER_TEST,
)
def grazing() -> Outcome:
    """Angles down to 3e-7."""
    return _tried("rectangles at a grazing angle", formulas.rectangle_with_limit)


@SECTION.case(
    "C4: rays along a rectangle's plane",
    symptom="NaN pixels, or a ghost of the rectangle very far away.",
    cause="d . n is 0, and in the plane all quotients are 0/0, which no comparison sorts out.",
    remedy="d . n = 0 is a miss before anything is divided by it.",
    expected="A miss, or in the plane a hit where the ray passes the rectangle. Never NaN.",
)
def along_the_plane() -> Outcome:
    """Beside it and in it, in whole numbers."""
    return flat_shapes.along_the_plane("rectangle")


@SECTION.case(
    "C5: rectangles without area",
    symptom="NaN pixels, or a scene that renders black for no reason said.",
    cause="Edges that are zero or parallel have no normal: 0/0.",
    remedy="Such a scene is refused with the place and the cure; no ray hits a zero normal anyway.",
    expected="An error at the edges or at the tangent; and no hit if such a rectangle gets through.",
)
def without_area() -> Outcome:
    """Edges of no length, one a multiple of the other, and a tangent along the normal."""
    rng = np.random.default_rng(2)
    corners, first = rng.integers(-20, 21, (2, 100, 3)) * 1.0
    second = first * rng.integers(-3, 4, (100, 1))
    first[::3] = 0
    card = {"center": [0, 0, 0], "normal": [1, 2, 3], "tangent": [2, 4, 6], "size": [1, 1]}
    bad = [(rectangle(*rows), "edges") for rows in np.stack((corners, first, second), 1).tolist()]
    bad.append(({"type": "rectangle", **card, "material": "plain"}, "tangent"))
    accepted = sum(not refused_at(scene(shape), f"/shapes/0/{place}", within=True) for shape, place in bad)
    origins = rng.normal(size=(100, 3)) * 50
    family = from_edges(np.arange(100), *(part.T.copy() for part in (corners, first, second)))
    rays = rays_of(origins.T.copy(), (corners - origins).T.copy())
    for number in range(100):
        family.intersect(number, rays)
    plain = by_dtype(projected_on_edges, (corners, first, second), origins, corners - origins)
    return Outcome(201, accepted + tally(~np.isinf(rays.t)), *(tally(~np.isinf(t)) for t in plain))


@SECTION.case(
    "C6: rays exactly through edges and corners",
    symptom="Pinholes in a floor of tiles where rays hit the seams exactly.",
    cause="u = 1 in one tile and u = 0 in the next are rounded to either side.",
    remedy="Both ends of 0 to 1 belong to the rectangle.",
    expected="Four parallelograms around a corner, all of whole numbers, let no ray through their seams.",
)
def through_edges_and_corners() -> Outcome:
    """In whole numbers."""
    return flat_shapes.leaks(flat_shapes.sheets_in_whole_numbers(), formulas.projected_on_edges)


@SECTION.case(
    "C7: long and narrow rectangles",
    symptom="Laths, cables and far road markings are frayed or too wide.",
    cause="An error along the long side counts a million times across the short one.",
    remedy="Triple products in float64, and no limit on d . n, which is small because the area is.",
    expected=ROUNDED + " Sides 1 to 1e6.",
    source=CORNER_TEST,
)
def long_and_narrow() -> Outcome:
    """Sides 1 to 1e6, rounded to float32."""
    return _tried("long and narrow rectangles")


@SECTION.case(
    "C8: rectangles of any size",
    symptom="A scene looks different in another unit: small parts vanish.",
    cause="Lengths and areas that stand in the code as numbers.",
    remedy="Every comparison is with zero or with a multiple of the numbers it belongs to.",
    expected=ROUNDED
    + " Sizes of 1e-12 to 1e12. Shape and rays times 2^-40 to 2^40 give the same t bit for bit.",
)
def any_size() -> Outcome:
    """Sizes of 1e-12 to 1e12, and one scene in many units."""
    limited = formulas.rectangle_with_limit
    few = itertools.islice(FLAT["skew parallelograms"](), 25)
    return total((_tried("rectangles of any size", limited), flat_shapes.scaled(few, limited)))


@SECTION.case(
    "C10: rays that start on a rectangle",
    symptom="Mirrors and shadows with specks: a surface hits itself.",
    cause="The distance of a start on the plane from the plane is a sum that rounds to 1e-16 instead of 0.",
    remedy="A hit nearer than the rounding of its own sum is a start on the rectangle.",
    expected="No hit. Starts are eighths of edges of whole numbers, exactly on the plane.",
)
def from_the_plane() -> Outcome:
    """In whole numbers."""
    return flat_shapes.from_the_plane("rectangle")
