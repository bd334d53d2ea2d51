"""What a fixed limit, a bound or a rounding loses of triangles: single questions with their own counts."""

from collections.abc import Iterable
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases import flat_formulas, oracle, solids
from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.documents import Json, rectangle, scene, triangle
from accuracy.hard_cases.draws import Case, Ray
from accuracy.hard_cases.scoring import EXCUSED, Textbook
from renderer.interaction import Rays
from renderer.math.arrays import Floats, Pairs
from renderer.math.numerics import EPS
from renderer.shapes.rectangles import from_edges
from schemas.errors import SceneError
from schemas.reading import read_scene

PRECISIONS = (np.float64, np.float32)
"""Those in which a formula is asked."""

REGRESSION = [
    [-1113.45459, -79.049614, -56.2431908],
    [-1113.45459, -87.0922699, -56.2431908],
    [-1113.45459, -79.2090149, -56.2431908],
]
"""On one line; pbrt-v4 once met it."""

REGRESSION_RAY = ([-1081.47925, 99.9999542, 87.7701111], [-32.1072998, -183.355865, -144.607635])
"""The ray that did."""

PARTS = ("vertices", "corner", "edges")
"""What lengths a flat shape has."""

UNITS = (-40, -13, 7, 40)
"""Powers of two by which a scene is scaled."""


def without_area() -> Outcome:
    """1,000 rays at 100 triangles on lines, as shapes and as a mesh."""
    corners, origins, targets = _lines()
    origins = np.concatenate((origins, [REGRESSION_RAY[0]]))
    directions = np.concatenate((targets - origins[:-1], [REGRESSION_RAY[1]]))
    everything = np.concatenate((corners, [REGRESSION]))
    mesh = solids.mesh(everything.reshape(-1, 3), np.arange(3 * len(everything)).reshape(-1, 3))
    plan = renderer.compile_scene(
        renderer.load_scene(scene(mesh, *(triangle(*rows) for rows in everything.tolist())))
    )
    uncounted = 2 * len(everything) - plan.numerics["degenerate_dropped"]
    hit = np.count_nonzero(renderer.trace(plan, origins, directions).shape >= 0)
    owners = np.append(np.repeat(np.arange(100), 10), 100)
    lost = [_met(everything[owners], origins, directions, dtype) for dtype in PRECISIONS]
    return Outcome(len(origins), int(hit) + abs(uncounted), *lost)


def _lines() -> tuple[Floats, Floats, Floats]:
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


def _met(corners: Floats, origins: Floats, directions: Floats, dtype: type[np.floating]) -> int:
    vertices = [part.astype(dtype) for part in corners.transpose(1, 0, 2)]
    with np.errstate(all="ignore"):
        t = flat_formulas.moeller_trumbore(vertices, origins.astype(dtype), directions.astype(dtype))
    return int(np.count_nonzero(~np.isinf(t)))


def scaled(family: Iterable[Case], textbook: Textbook) -> Outcome:
    """Shapes and rays in other units: wrong is every t that is not the same bit for bit."""
    return total(_scaled(document, rays, textbook) for document, rays in family)


def _scaled(document: Json, rays: list[Ray], textbook: Textbook) -> Outcome:
    here = _answers(document, rays, textbook, 0)
    others = [_answers(document, rays, textbook, power) for power in UNITS]
    wrong = [sum(int(np.count_nonzero(there[i] != here[i])) for there in others) for i in range(3)]
    return Outcome(len(rays) * len(UNITS), *wrong)


def _answers(document: Json, rays: list[Ray], textbook: Textbook, power: int) -> list[Pairs]:
    """Distances (N,) by the renderer, and by a formula in float64 and float32, all times a power of two."""
    parts = {name: np.ldexp(document[name], power).tolist() for name in PARTS if name in document}
    written = scene(document | parts)
    origins, directions = np.ldexp(np.array(rays).transpose(1, 0, 2), power)
    plan = renderer.compile_scene(renderer.load_scene(written))
    shape = read_scene(written)[0].shapes[0]
    with np.errstate(all="ignore"):
        plain = [textbook(shape, origins.astype(dtype), directions.astype(dtype)) for dtype in PRECISIONS]
    return [renderer.trace(plan, origins, directions).t, *plain]


def off_the_plane(family: Iterable[Case]) -> Outcome:
    """Hits whose point is off the exact plane by more than 8 eps of the largest coordinate of a vertex."""
    return total(_off_the_plane(document, rays) for document, rays in family)


def _off_the_plane(document: Json, rays: list[Ray]) -> Outcome:
    shape, true = _true(document, rays)
    origins, directions = np.array(rays).transpose(1, 0, 2)
    plan = renderer.compile_scene(renderer.load_scene(scene(document)))
    found = renderer.trace(plan, origins, directions).position
    positions = [found, *(_along_the_ray(shape, origins, directions, dtype) for dtype in PRECISIONS)]
    hit = [i for i, answer in enumerate(true) if answer.hit]
    counts = []
    for places in positions:
        allowed = 8 * float(np.finfo(places.dtype).eps) * float(np.abs(shape.vertices).max())
        counts.append(sum(not _height(places[i], true[i]) <= allowed for i in hit))
    return Outcome(len(hit), *counts)


def _along_the_ray(shape: Any, origins: Floats, directions: Floats, dtype: type[np.floating]) -> Pairs:
    """Points o + t d (N, 3), with t by the textbook."""
    start, along = origins.astype(dtype), directions.astype(dtype)
    with np.errstate(all="ignore"):
        return np.asarray(start + flat_formulas.triangle(shape, start, along)[:, None] * along)


def _height(place: Floats, true: Answer) -> float:
    with np.errstate(invalid="ignore"):
        return abs(float(np.dot(place.astype(float) - true.position, true.normal)))


def dropped_by_a_bound(family: Iterable[Case]) -> Outcome:
    """True hits that Woop's test finds, and loses with the bound on the error of t."""
    return total(_dropped(document, rays) for document, rays in family)


def _dropped(document: Json, rays: list[Ray]) -> Outcome:
    shape, true = _true(document, rays)
    origins, directions = np.array(rays).transpose(1, 0, 2)
    plan = renderer.compile_scene(renderer.load_scene(scene(document)))
    # Within roundings of the border a hit is a matter of opinion.
    sure = np.array([answer.hit and answer.margin > EXCUSED * EPS for answer in true])
    lost = sure & np.isinf(renderer.trace(plan, origins, directions).t)
    counts = []
    for dtype in PRECISIONS:
        start, along = origins.astype(dtype), directions.astype(dtype)
        vertices = flat_formulas.vertices_of(shape, start.dtype)
        with np.errstate(all="ignore"):
            free, bounded = (flat_formulas.woop(vertices, start, along, bounded=b) for b in (False, True))
        counts.append(int(np.count_nonzero(sure & np.isfinite(free) & np.isinf(bounded))))
    return Outcome(int(np.count_nonzero(sure)), int(np.count_nonzero(lost)), *counts)


def _true(document: Json, rays: list[Ray]) -> tuple[Any, list[Answer]]:
    shape = read_scene(scene(document))[0].shapes[0]
    return shape, [oracle.answer(shape, *ray) for ray in rays]


def rectangles_without_area() -> Outcome:
    """Wrong is a scene that is read, an error elsewhere than at the edges, and a hit of the kernel."""
    rng = np.random.default_rng(2)
    corners, first = rng.integers(-20, 21, (2, 100, 3)) * 1.0
    second = first * rng.integers(-3, 4, (100, 1))
    first[::3] = 0
    refused = sum(
        _refused(rectangle(*rows), "/shapes/0/edges")
        for rows in np.stack((corners, first, second), 1).tolist()
    )
    along = {
        "type": "rectangle",
        "center": [0, 0, 0],
        "normal": [1, 2, 3],
        "tangent": [2, 4, 6],
        "size": [1, 1],
    }
    refused += _refused({**along, "material": "plain"}, "/shapes/0/tangent")
    origins = rng.normal(size=(100, 3)) * 50
    found, *plain = _met_anyway(corners, first, second, origins, corners - origins)
    return Outcome(201, 101 - refused + found, *plain)


def _refused(shape: Json, place: str) -> bool:
    try:
        read_scene(scene(shape))
    except SceneError as error:
        return all(problem.pointer.startswith(place) for problem in error.errors)
    return False


def _met_anyway(
    corners: Floats, first: Floats, second: Floats, origins: Floats, directions: Floats
) -> tuple[int, ...]:
    """Rays, each asked about its own rectangle, that do not say a miss: of the renderer, and of a formula."""
    family = from_edges(np.arange(100), *(np.ascontiguousarray(part.T) for part in (corners, first, second)))
    found = 0
    for number in range(100):
        one = np.array([number])
        rays = Rays(origins[one].T.copy(), directions[one].T.copy(), one, np.zeros(1, dtype=np.int64))
        family.meet(number, rays)
        found += int(np.count_nonzero(~np.isinf(rays.t)))
    counts = [found]
    for dtype in PRECISIONS:
        parts: list[Pairs] = [part.astype(dtype) for part in (corners, first, second)]
        with np.errstate(all="ignore"):
            t = flat_formulas.projected_on_edges(parts, origins.astype(dtype), directions.astype(dtype))
        counts.append(int(np.count_nonzero(~np.isinf(t))))
    return tuple(counts)
