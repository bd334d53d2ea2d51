"""Hard cases J: numbers that a scene may hold, and those that it must not."""

import copy
import itertools
import json
from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    scene,
    sphere,
    sun,
    triangle,
)
from accuracy.hard_cases.harness import (
    EPS,
    Cases,
    Outcome,
    Outcomes,
    eps_of,
    exact,
    in_both,
    refused_at,
    tally,
    traced,
)
from renderer.math.arrays import Floats, Pairs, unit
from schemas.pointers import Parts, pointer


def everything() -> Json:
    """A scene with a number in every field that takes one."""
    card = {"center": [1, 1, 1], "normal": [0, 0, 1], "tangent": [1, 0, 0], "size": [2, 1]}
    corners: list[list[float]] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    flat = {"vertices": corners, "triangles": [[0, 1, 2]], "uvs": [[0, 0], [1, 0], [0, 1]]}
    turned = {"scale": [1, 2, 3], "rotate": {"axis": [0, 1, 0], "degrees": 30}, "translate": [1, 2, 3]}
    strengths = {"specular": 0.1, "shininess": 9, "bump_height": 1, "displacement_height": 1}
    strengths |= {"mirror": 0.1, "transmission": 0.1, "ior": 1.5, "max_depth": 3}
    document = scene(
        triangle(*corners, normals=[[0, 0, 1]] * 3, uvs=[[0, 0], [1, 0], [0, 1]]),
        {"type": "rectangle", **card, "material": "plain"},
        rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]),
        ellipsoid([0, 1, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]),
        sphere([0, 1, 0], 1),
        mesh(**flat, **turned),
        lights=[
            {"type": "rectangle", **card, "color": [1, 1, 1]},
            lamp([0, 5, 0], [1, 0, 0], [0, 0, 1]),
            bulb([0, 6, 0]),
            sun([0, -1, 0]),
        ],
        camera=camera(up=[0, 1, 0], focal_length=1, lens_radius=0.1, focus_distance=5),
        materials={"plain": {**phong(), **strengths}},
        textures={"board": {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [8, 8]}},
        display={"transfer": "srgb", "exposure": 0},
    )
    # Written and read again, no two fields share a list.
    read: Json = json.loads(json.dumps(document))
    return read


def numbers_in(node: Any, parts: Parts = ()) -> Iterator[Parts]:
    """Where the numbers of a document stand."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield from numbers_in(value, (*parts, key))
    if isinstance(node, int | float):
        yield parts


def changed(document: Json, parts: Parts, value: object) -> Json:
    """A copy with another value in one place."""
    other = copy.deepcopy(document)
    node: Any = other
    for part in parts[:-1]:
        node = node[part]
    node[parts[-1]] = value
    return other


def vectors_in(node: Any, parts: Parts = ()) -> Iterator[Parts]:
    """Where the directions and edges of a document stand."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        if key in {"up", "normal", "tangent", "direction", "axis"}:
            yield (*parts, key)
        elif key in {"edges", "axes", "normals"}:
            yield from ((*parts, key, i) for i in range(len(value)))
        else:
            yield from vectors_in(value, (*parts, key))


def not_finite() -> Outcome:
    """Each of four texts in place of each number of a scene with everything."""
    document = everything()
    accepted = []
    for parts in numbers_in(document):
        text = json.dumps(changed(document, parts, "HERE"))
        sources = [text.replace('"HERE"', word) for word in ("NaN", "Infinity", "-Infinity", "1e999")]
        accepted += [not refused_at(source.encode(), pointer(parts)) for source in sources]
    return Outcome(len(accepted), sum(accepted))


LARGE = [1e308, -1e308, 1e200, 1.01e15]
SMALL = [5e-324, 1e-320, 1e-200, 0.99e-100]


def wall(size: float, distance: float) -> Json:
    """A square before a ray from the origin along z."""
    half = size / 2
    return rectangle([-half, -half, distance], [size, 0, 0], [0, size, 0])


def plain_distance(size: float, distance: float, dtype: Any) -> float:
    """Where a ray along z hits the wall, by the textbook's formula, n . corner / n . d."""
    half, along, place = dtype(size / 2), dtype(size), dtype(distance)
    normal = np.cross([along, dtype(0), dtype(0)], [dtype(0), along, dtype(0)]).astype(dtype)
    corner = np.array([-half, -half, place], dtype)
    return float((normal * corner).sum() / normal[2])


def walls(sizes: list[float], *, refused: bool) -> Outcome:
    """Walls of these sizes, as far away as they are large: refused, or hit where they are to 4 eps."""

    def is_off(size: float, dtype: Any) -> bool:
        return not abs(plain_distance(size, abs(size), dtype) - abs(size)) <= 4 * eps_of(dtype) * abs(size)

    wrong = 0
    for size in sizes:
        shape = wall(size, abs(size))
        if refused:
            wrong += not refused_at(scene(shape), "/shapes/0", within=True)
        else:
            wrong += not abs(_distance_along_z(shape, 0.0) - size) <= 4 * EPS * size
    return Outcome(len(sizes), wrong, *in_both(lambda dtype: sum(is_off(size, dtype) for size in sizes)))


def _distance_along_z(shape: Json, start: float) -> float:
    return float(traced([shape], [[0.0, 0.0, start]], [[0.0, 0.0, 1.0]]).t[0])


def large() -> Outcomes:
    """Walls as far away as they are large, and two planes of whole numbers."""
    t = _distance_along_z(wall(16.0, 16777217.0), 16777216.0)
    plain = in_both(lambda dtype: int(dtype(16777217) - dtype(16777216) != 1))
    kept = walls([10.0**k for k in range(16)], refused=False)
    return [walls(LARGE, refused=True), kept, Outcome(1, int(t != 1), *plain)]


def small() -> Outcomes:
    """Walls as near as they are small, and vectors of lengths from 1e-323 to 1."""
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(3, 300)) * 10.0 ** -np.linspace(0, 323, 300)
    vectors = vectors[:, (vectors != 0).any(axis=0)]
    true = exact_units(vectors)

    def off(units: Pairs, eps: float) -> int:
        return tally(~(np.abs(units - true) <= 4 * eps).all(axis=0))

    def plain(dtype: type[np.floating]) -> int:
        given = vectors.astype(dtype)
        return off(given / np.sqrt((given * given).sum(axis=0)), eps_of(dtype))

    units = Outcome(vectors.shape[1], off(unit(vectors), EPS), *in_both(plain))
    kept = walls([10.0**-k for k in range(0, 101, 5)], refused=False)
    return [walls(SMALL, refused=True), kept, units]


@exact
def exact_units(vectors: Floats) -> Floats:
    """Vectors (3, N) over their lengths, each component rounded once."""
    columns = []
    for vector in vectors.T.tolist():
        parts = [mpmath.mpf(x) for x in vector]
        length = mpmath.sqrt(mpmath.fsum(x * x for x in parts))
        columns.append([float(x / length) for x in parts])
    return np.array(columns).T


COUNTS: list[Parts] = [
    ("camera", "width"),
    ("camera", "height"),
    ("sampling", "antialiasing", "samples"),
    ("sampling", "light", "samples"),
]


def counts() -> Outcome:
    """Sizes of the picture and numbers of samples."""
    values: list[Any] = [0, -1, 1.5, 2.5, True, "4", 10**9, 10**300, None]
    document = everything()
    places = [(parts, value) for parts in COUNTS for value in values]
    wrong = sum(not refused_at(changed(document, parts, value), pointer(parts)) for parts, value in places)
    return Outcome(len(places), wrong)


def zero_vectors() -> Outcome:
    """Every direction and edge of a scene with everything, and two rays."""
    document = everything()
    zeros: list[list[float]] = [[0, 0, 0], [0.0, -0.0, 0.0]]
    places = list(itertools.product(vectors_in(document), zeros))
    wrong = sum(not refused_at(changed(document, parts, zero), pointer(parts)) for parts, zero in places)
    still = traced([sphere([0, 0, 0], 1)], [[0.0, 0.0, 5.0], [0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]] * 2)
    return Outcome(len(places) + 2, wrong + tally(np.isfinite(still.t)))


CASES: Cases = {
    "J1: NaN and infinity in a scene file": not_finite,
    "J2: very large numbers": large,
    "J3: very small numbers": small,
    "J4: counts that are none": counts,
    "J5: vectors of length zero": zero_vectors,
}
