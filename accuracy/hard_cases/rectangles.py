"""Hard cases C: rectangles."""

import itertools

import numpy as np

from accuracy.hard_cases import flat_shapes as flat
from accuracy.hard_cases import formulas
from accuracy.hard_cases.documents import rectangle, scene
from accuracy.hard_cases.families import FLAT
from accuracy.hard_cases.formulas import by_dtype, projected_on_edges
from accuracy.hard_cases.harness import Cases, Outcome, Outcomes, rays_of, refused_at, tally
from renderer.shapes.rectangles import from_edges


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


def any_size() -> Outcomes:
    """Sizes of 1e-12 to 1e12, and one scene in many units."""
    limited = formulas.rectangle_with_limit
    few = itertools.islice(FLAT["skew parallelograms"](), 25)
    return (flat.tried("rectangles of any size", limited), flat.scaled(few, limited))


CASES: Cases = {
    "C1: edges that are not perpendicular": lambda: flat.tried("skew parallelograms", formulas.rectangle),
    "C2: corners of a room": lambda: flat.leaks(
        itertools.chain(flat.corners_of_rooms(), flat.skew_corners()),
        formulas.projected_on_edges,
    ),
    "C9: edges that agree but for rounding": lambda: flat.leaks(
        flat.turned_boxes(), formulas.closed_parallelogram
    ),
    "C3: rectangles at a grazing angle": lambda: flat.tried(
        "rectangles at a grazing angle", formulas.rectangle_with_limit
    ),
    "C4: rays along a rectangle's plane": lambda: flat.along_the_plane("rectangle"),
    "C5: rectangles without area": without_area,
    "C6: rays exactly through edges and corners": lambda: flat.leaks(
        flat.sheets_in_whole_numbers(), formulas.projected_on_edges
    ),
    "C7: long and narrow rectangles": lambda: flat.tried("long and narrow rectangles", formulas.rectangle),
    "C8: rectangles of any size": any_size,
    "C10: rays that start on a rectangle": lambda: flat.from_the_plane("rectangle"),
}
