"""Hard cases: numbers that a scene may hold, and those that it must not."""

import json
from typing import Any

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, rectangle, scene, sphere
from accuracy.hard_cases.written_scenes import (
    changed,
    everything,
    numbers_in,
    refused_at,
    vectors_in,
)
from renderer.math.arrays import Floats, Pairs, unit
from renderer.math.numerics import EPS
from schemas.errors import SceneError
from schemas.pointers import Parts, pointer
from schemas.reading import read_scene

SECTION = Section("Values")

PRECISIONS: list[tuple[type[np.floating], float]] = [
    (dtype, float(np.finfo(dtype).eps)) for dtype in (np.float64, np.float32)
]


@SECTION.case(
    "NaN and infinity in a scene file",
    symptom="A black picture, or one full of holes, and nobody says why.",
    cause="JSON has no NaN, but Python's parser takes it, and Infinity, and makes 1e999 infinite.",
    remedy="Every number of the scene language must be finite.",
    expected="Refused at its own place, in every field that takes a number.",
    source="RFC 8259, section 6",
)
def not_finite() -> Outcome:
    """Each of four texts in place of each number of a scene with everything."""
    document = everything()
    tried = wrong = plain = 0
    for parts in numbers_in(document):
        text = json.dumps(changed(document, parts, "HERE"))
        for word in ("NaN", "Infinity", "-Infinity", "1e999"):
            source = text.replace('"HERE"', word)
            tried, wrong = tried + 1, wrong + (not refused_at(source.encode(), pointer(parts)))
            plain += isinstance(json.loads(source), dict)
    return Outcome(tried, wrong, plain)


LARGE = [1e308, -1e308, 1e200, 1.01e15]
SMALL = [5e-324, 1e-320, 1e-200, 0.99e-100]


def wall(size: float, distance: float) -> Json:
    """A square before a ray from the origin along z."""
    half = size / 2
    return rectangle([-half, -half, distance], [size, 0, 0], [0, size, 0])


def plain_distance(size: float, distance: float, dtype: type[np.floating]) -> float:
    """Where a ray along z meets the wall, by the textbook's formula, n . corner / n . d."""
    half, along, place = dtype(size / 2), dtype(size), dtype(distance)
    with np.errstate(all="ignore"):
        normal = np.cross([along, dtype(0), dtype(0)], [dtype(0), along, dtype(0)]).astype(dtype)
        corner = np.array([-half, -half, place], dtype)
        return float((normal * corner).sum() / normal[2])


def walls(sizes: list[float], refused: bool) -> Outcome:
    """Walls of these sizes, as far away as they are large: refused, or met where they are to 4 eps."""
    wrong, plain = 0, [0, 0]
    for size in sizes:
        document = scene(wall(size, abs(size)))
        if refused:
            wrong += not _refused(document)
        else:
            plan = renderer.compile_scene(renderer.load_scene(document))
            t = renderer.trace(plan, [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]).t[0]
            wrong += not abs(t - size) <= 4 * EPS * size
        for i, (dtype, eps) in enumerate(PRECISIONS):
            with np.errstate(all="ignore"):
                t = plain_distance(size, abs(size), dtype)
            plain[i] += not abs(t - abs(size)) <= 4 * eps * abs(size)
    return Outcome(len(sizes), wrong, *plain)


def _refused(document: Json) -> bool:
    try:
        read_scene(document)
    except SceneError as error:
        return all(problem.pointer.startswith("/shapes/0/") for problem in error.errors)
    return False


@SECTION.case(
    "very large numbers",
    symptom="Shapes vanish, or a whole picture is NaN.",
    cause="Squares and cubes of 1e200 are infinite; float32 makes 1e39 infinite, and 16777217 one less.",
    remedy="Coordinates and sizes are float64 and at most 1e15, so that their squares and cubes are finite.",
    expected="Larger ones are refused at their place; walls of up to 1e15 units are met at their distance to "
    "4 eps, and a wall at 16777217 is met 1 unit from 16777216.",
    source="IEEE 754",
)
def large() -> Outcome:
    """Walls as far away as they are large, and two planes of whole numbers."""
    kept = [10.0**k for k in range(16)]
    document = scene(wall(16.0, 16777217.0))
    plan = renderer.compile_scene(renderer.load_scene(document))
    t = renderer.trace(plan, [[0.0, 0.0, 16777216.0]], [[0.0, 0.0, 1.0]]).t[0]
    apart = np.float32(16777217) - np.float32(16777216)
    return total(
        [walls(LARGE, refused=True), walls(kept, refused=False), Outcome(1, int(t != 1), 0, int(apart != 1))]
    )


@SECTION.case(
    "very small numbers",
    symptom="A tiny model is empty, or a direction written in tiny numbers gives NaN.",
    cause="The square of 1e-200 is 0, and so is the length of such a vector; float32 makes 1e-50 itself 0.",
    remedy="Sizes are at least 1e-100; vectors are divided by their largest component and squared then.",
    expected="Smaller sizes are refused at their place; walls down to 1e-100 units are met to 4 eps; "
    "directions of any length down to 5e-324 have unit vectors right to 4 eps a component.",
    source="Blue 1978, A portable Fortran program to find the Euclidean norm of a vector",
)
def small() -> Outcome:
    """Walls as near as they are small, and vectors of lengths from 1e-323 to 1."""
    kept = [10.0**-k for k in range(0, 101, 5)]
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(3, 300)) * 10.0 ** -np.linspace(0, 323, 300)
    vectors = vectors[:, (vectors != 0).any(axis=0)]
    wrong = off_unit(unit(vectors), vectors, EPS)
    plain = []
    for dtype, eps in PRECISIONS:
        given = vectors.astype(dtype)
        with np.errstate(all="ignore"):
            plain.append(off_unit(given / np.sqrt((given * given).sum(axis=0)), vectors, eps))
    return total(
        [walls(SMALL, refused=True), walls(kept, refused=False), Outcome(vectors.shape[1], wrong, *plain)]
    )


def off_unit(units: Pairs, vectors: Floats, eps: float) -> int:
    """Unit vectors (3, N) with a component off by more than 4 eps; NaN is off."""
    wrong = 0
    for got, vector in zip(units.T, vectors.T, strict=True):
        exact = [mpmath.mpf(float(x)) for x in vector]
        length = mpmath.sqrt(mpmath.fsum(x * x for x in exact))
        wrong += not all(
            abs(float(g) - float(x / length)) <= 4 * eps for g, x in zip(got, exact, strict=True)
        )
    return wrong


COUNTS: list[Parts] = [
    ("camera", "width"),
    ("camera", "height"),
    ("sampling", "antialiasing", "samples"),
    ("sampling", "light", "samples"),
]


@SECTION.case(
    "counts that are none",
    symptom="The service runs out of memory, or draws another size than was asked for.",
    cause="int() makes 1 of 1.5 and of true, and a billion columns are allocated before anyone looks.",
    remedy="Counts are whole numbers from 1 to 65536, written without quotes; 2.0 is 2.",
    expected="Refused at their place while the scene is read, before anything is allocated.",
    source="geometry",
)
def counts() -> Outcome:
    """Sizes of the picture and numbers of samples."""
    values: list[Any] = [0, -1, 1.5, 2.5, True, "4", 10**9, 10**300, None]
    document = everything()
    places = [(parts, value) for parts in COUNTS for value in values]
    wrong = sum(not refused_at(changed(document, parts, value), pointer(parts)) for parts, value in places)
    taken = sum(value is not None and int(value) > 0 for _, value in places)
    return Outcome(len(places), wrong, taken)


@SECTION.case(
    "vectors of length zero",
    symptom="A shape, a light or the whole picture is NaN.",
    cause="0 divided by 0, when the vector is made a unit vector.",
    remedy="A direction of length zero is refused when the scene is read; a ray without direction misses.",
    expected="Refused at its place, +0 and -0 alike, in every field that takes a direction or an edge.",
    source="geometry",
)
def zero_vectors() -> Outcome:
    """Every direction and edge of a scene with everything, and one ray."""
    document = everything()
    places = list(vectors_in(document))
    zeros: list[list[float]] = [[0, 0, 0], [0.0, -0.0, 0.0]]
    wrong = sum(
        not refused_at(changed(document, parts, zero), pointer(parts)) for parts in places for zero in zeros
    )
    with np.errstate(invalid="ignore"):
        plain = sum(
            bool(np.isnan(np.array(zero) / np.linalg.norm(zero)).any()) for _ in places for zero in zeros
        )
    plan = renderer.compile_scene(renderer.load_scene(scene(sphere([0, 0, 0], 1))))
    still = renderer.trace(plan, [[0.0, 0.0, 5.0], [0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]] * 2)
    return Outcome(len(places) * 2 + 2, wrong + int(np.isfinite(still.t).sum()), plain)
