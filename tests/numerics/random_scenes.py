"""Random scenes of all kinds of shapes, rays at them, and what exact arithmetic says of both."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

import renderer
from schemas.quality import FixedQuality
from schemas.reading import read_scene
from tests import documents
from tests.documents import (
    Json,
    bulb,
    ellipsoid,
    lamp,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.numerics import oracle
from tests.numerics.oracle import Answer
from tests.numerics.tracing import EPS
from tests.pictures.parts import plan_of

Floats = np.ndarray
RAYS = 100
TRIANGLES = 40
MESH = 2
"""Number of the mesh among the shapes."""
LAMP_CORNER, LAMP_EDGES = np.array([-1.3, 5.1, -0.4]), np.array([[1.5, 0.1, 0.2], [0.1, 0.3, 1.7]])
BULB, SUN = np.array([4.2, 3.3, 5.1]), np.array([0.3, -1.0, 0.2])


@dataclass(frozen=True)
class Part:
    """What a ray may hit: a shape, or a triangle of the mesh."""

    shape: int
    primitive: int
    exact: Any

    @property
    def kind(self) -> str:
        return "mesh" if self.shape == MESH else str(self.exact.type)


@dataclass(frozen=True)
class Scene:
    """A scene, its parts, and rays at them with directions of length 1."""

    document: Json
    parts: list[Part]
    origins: Floats
    directions: Floats

    def hits(self, directions: Floats, quality: FixedQuality) -> renderer.Hits:
        return renderer.trace(plan_of(self.document, quality), self.origins, directions)


@cache
def drawn(seed: int) -> Scene:
    """Triangles, a mesh of loose ones, rectangles, ellipsoids and a sphere, all within about 4 units.

    Rays begin in the ellipsoids, among the shapes and farther out, and look at places inside and beside them.
    """
    rng = np.random.default_rng(seed)
    places = rng.uniform(-2, 2, (7 + TRIANGLES, 3))
    loose = places[7:, None] + rng.normal(size=(TRIANGLES, 3, 3)) * 0.4
    shapes = [
        *(triangle(*rng.uniform(-2, 2, (3, 3)).tolist()) for _ in range(MESH)),
        mesh(loose),
        *(rectangle(place.tolist(), *rng.normal(size=(2, 3)).tolist()) for place in places[:3]),
        *(ellipsoid(place.tolist(), *semi_axes(rng)) for place in places[3:6]),
        sphere(places[6].tolist(), 0.4),
    ]
    lights = [lamp(LAMP_CORNER.tolist(), *LAMP_EDGES.tolist()), bulb(BULB.tolist()), sun(SUN.tolist())]
    document = scene(*shapes, lights=lights, sampling=sampled(1, 4))
    origins = rng.normal(size=(RAYS, 3)) * rng.choice([1, 4, 100], (RAYS, 1))
    origins[:8] = places[3:7].repeat(2, axis=0) + rng.normal(size=(8, 3)) * 0.05
    ways = places[rng.integers(0, len(places), RAYS)] + rng.normal(size=(RAYS, 3)) * 0.3 - origins
    lengths = np.linalg.norm(ways, axis=1)[:, None]
    return Scene(document, parts_of(document, loose), origins, ways / lengths)


def mesh(corners: Floats) -> Json:
    """Of triangles (K, 3, 3) that share no vertices."""
    return documents.mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def semi_axes(rng: np.random.Generator) -> list[list[float]]:
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return (turned * rng.uniform(0.2, 0.7, 3)[:, None]).tolist()


def parts_of(document: Json, loose: Floats) -> list[Part]:
    shapes = read_scene(document)[0].shapes
    triangles = read_scene(scene(*(triangle(*corners) for corners in loose.tolist())))[0].shapes
    whole = [Part(i, 0, shape) for i, shape in enumerate(shapes) if i != MESH]
    return [*whole, *(Part(MESH, i, shape) for i, shape in enumerate(triangles))]


def nearest(parts: list[Part], origin: Floats, direction: Floats) -> tuple[Part, Answer] | None:
    """What a ray hits first; it must not pass within roundings of any border."""
    answers = [(part, oracle.answer(part.exact, origin, direction)) for part in parts]
    assert min(answer.margin for _, answer in answers) > 16 * EPS
    return min((found for found in answers if found[1].hit), key=lambda found: found[1].t, default=None)


def ways_to_lights(place: Floats) -> list[tuple[list[Floats], float]]:
    """Of each light: ways from a place to its light points, and in units of these where shadows end."""
    quarters = [(u, v) for u in (0.25, 0.75) for v in (0.25, 0.75)]
    of_lamp = [LAMP_CORNER + u * LAMP_EDGES[0] + v * LAMP_EDGES[1] - place for u, v in quarters]
    return [(of_lamp, 1.0), ([BULB - place], 1.0), ([-SUN], math.inf)]


def seen(
    parts: list[Part], own: Part, true: Answer, place: Floats, way: Floats, end: float, margin: float
) -> bool | None:
    """Whether a light point is seen from a hit; None where `margin` says that it is a matter of opinion.

    A surface hides all that is below its horizon, and an ellipsoid all lights from its inside: none is in it.
    """
    if own.kind == "ellipsoid" and np.dot(true.normal, place - np.array(own.exact.center)) < 0:
        return False
    height = float(np.dot(true.normal, way)) / math.hypot(*way)
    if abs(height) <= margin:
        return None
    answers = [oracle.answer(part.exact, place, way) for part in parts if part is not own]
    if height < 0 or any(answer.t < end and answer.margin > margin for answer in answers):
        return False
    return None if any(answer.margin <= margin for answer in answers) else True
