"""Floors, covers, rooms and lights, anywhere and of any size, with what is seen from where."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import renderer
from renderer.integrator import radiance
from schemas.quality import FixedQuality
from tests.documents import (
    Json,
    bulb,
    dark_scene,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sun,
    triangle,
)
from tests.numerics.tracing import rays_of
from tests.pictures.parts import plan_of

Floats = np.ndarray
OFFSETS = (0.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
"""Distances of the scene from the origin, in shares of its own size."""
SCALES = tuple(2.0**exponent for exponent in (-20, -10, 0, 10, 20))
PATTERNS = ("uniform", "random", "stratified", "sobol")

FLOORS = ("tiles", "triangles", "mesh")
"""Four parallelograms, 8 triangles, and a mesh of 72, which are in a tree."""
COVERS = ("rectangle", "triangles", "mesh", "ellipsoid")
PARTS = {"tiles": 2, "triangles": 2, "mesh": 6}
"""Along a side of a floor, by its kind."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A frame of a scene: centre (3,), unit rows across, along and up, and a unit of length."""

    center: Floats
    axes: Floats
    unit: float

    def way(self, *steps: Any) -> Floats:
        """A vector, or vectors (N, 3), by steps across, along and up."""
        return self.unit * np.stack(np.broadcast_arrays(*steps), axis=-1) @ self.axes

    def at(self, *steps: Any) -> Floats:
        """A place, or places (N, 3), by steps from the centre."""
        return self.center + self.way(*steps)


def places(
    name: str, offsets: Sequence[float] = OFFSETS, scales: Sequence[float] = (1.0,), turns: int = 1
) -> Iterator[tuple[np.random.Generator, Place]]:
    """Turned places at all offsets and of all scales, each with numbers to draw more from."""
    for number, (offset, unit, _) in enumerate(itertools.product(offsets, scales, range(turns))):
        chosen = np.random.default_rng([number, *name.encode()])
        center = chosen.normal(size=3) * offset * unit
        yield chosen, Place(center, np.linalg.qr(chosen.normal(size=(3, 3)))[0].T, unit)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Rays (N, 3) at the first `floors` of some shapes, and the share of each light seen from there."""

    shapes: list[Json]
    lights: list[Json]
    floors: int
    origins: Floats
    directions: Floats
    seen: Floats

    def hits(self, quality: FixedQuality, pattern: str = "uniform", points: int = 9) -> renderer.Hits:
        sampling = sampled(1, points, light=pattern)
        document = scene(*self.shapes, lights=self.lights, sampling=sampling)
        return renderer.trace(plan_of(document, quality), self.origins, self.directions)

    def check(self, quality: FixedQuality, pattern: str = "uniform", points: int = 9) -> None:
        hits = self.hits(quality, pattern, points)
        assert ((hits.shape >= 0) & (hits.shape < self.floors)).all()
        np.testing.assert_array_equal(hits.visibility, self.seen)


def floor(kind: str, place: Place) -> list[Json]:
    """Ten units square, flat, made of neighbours that share corners."""
    sides = PARTS[kind]
    steps = np.linspace(-5, 5, sides + 1)
    if kind == "tiles":
        edges = place.way(10 / sides, 0, 0), place.way(0, 10 / sides, 0)
        corners = itertools.product(steps[:-1], repeat=2)
        return [rectangle(place.at(x, y, 0), *edges) for x, y in corners]
    return triangulated(kind, *grid(place, steps, 0.0))


def grid(place: Place, steps: Floats, height: Any) -> tuple[Floats, list[tuple[int, int, int]]]:
    """Vertices (V, 3) of a square grid and two triangles a cell, fronts up."""
    x, y = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    size = steps.size
    cells = [size * i + j for i in range(size - 1) for j in range(size - 1)]
    lower = [(c, c + size, c + size + 1) for c in cells]
    return place.at(x, y, height), lower + [(c, c + size + 1, c + 1) for c in cells]


def triangulated(kind: str, vertices: Floats, faces: Sequence[tuple[int, int, int]]) -> list[Json]:
    """Triangles one by one, or as one mesh."""
    if kind == "mesh":
        return [mesh(vertices, faces)]
    return [triangle(*vertices[list(face)]) for face in faces]


def cover(kind: str, place: Place, middle: Floats) -> list[Json]:
    """Eighteen units wide and flat, about a place above the floor."""
    here = Place(middle, place.axes, place.unit)
    if kind == "rectangle":
        return [rectangle(here.at(-9, -9, 0), place.way(18, 0, 0), place.way(0, 18, 0))]
    if kind == "ellipsoid":
        height = float(np.linalg.norm((middle - place.center) @ place.axes[2])) / place.unit
        return [ellipsoid(middle, *(place.way(*row) for row in np.diag([12, 12, height / 4])))]
    return triangulated(kind, *grid(here, np.linspace(-9, 9, 2 if kind == "triangles" else 6), 0.0))


def lights(place: Place, way: Floats) -> list[Json]:
    """A bulb, a lamp and a sun in one direction."""
    position = place.center + way
    first, second = place.way(0.1, 0, 0), place.way(0, 0.1, 0)
    return [bulb(position), lamp(position, first, second, visible=False), sun(-way)]


def bare(kind: str, place: Place, chosen: np.random.Generator) -> View:
    """A floor and nothing above it, seen and lit at angles down to 3e-3: all lights are seen whole."""
    angle, view = 10 ** chosen.uniform(-2.5, 0), 10 ** chosen.uniform(-2.5, 0, 40)
    return _viewed(kind, place, _way(place, angle), 1.0, chosen.uniform(-3, 3, (2, 40)), view)


def _way(place: Place, angle: float) -> Floats:
    """To lights eight units away at an angle above the floor."""
    return place.way(8 * np.cos(angle), 0, 8 * np.sin(angle))


def on_seams(kind: str, place: Place, chosen: np.random.Generator) -> View:
    """The same, seen exactly on the lines where the parts of the floor meet, as well as doubles can say."""
    inner = chosen.choice(np.linspace(-5, 5, PARTS[kind] + 1)[1:-1], 20)
    along = chosen.uniform(-3, 3, 20)
    # Across the floor, along it, from corner to corner of the cells, and the corners themselves.
    spots = np.stack((np.r_[inner, along, along, inner[:5]], np.r_[along, inner, along, inner[:5]]))
    angle, view = 10 ** chosen.uniform(-2.5, 0), 10 ** chosen.uniform(-2.5, 0, spots.shape[1])
    return _viewed(kind, place, _way(place, angle), 1.0, spots, view)


def covered(kind: str, above: str, share: float, place: Place, chosen: np.random.Generator) -> View:
    """A floor under a cover at a share of the way to the lights: none is seen."""
    angle = chosen.uniform(0.1, 1.5)
    way = _way(place, angle)
    view = 10 ** chosen.uniform(-2.5, -0.5, 40) * min(1.0, share * 8 * np.sin(angle))
    spots = chosen.uniform(-3, 3, (2, 40))
    found = _viewed(kind, place, way, 0.0, spots, view)
    return replace(found, shapes=[*found.shapes, *cover(above, place, place.center + share * way)])


def _viewed(kind: str, place: Place, way: Floats, seen: float, spots: Floats, view: Floats) -> View:
    """Rays at spots (2, N) of a floor, from `view` above it and a unit along."""
    targets, shapes, shining = place.at(*spots, 0), floor(kind, place), lights(place, way)
    origins = targets + place.way(0, 0.5 * np.cos(view), 0.5 * np.sin(view))
    share = np.full((view.size, len(shining)), seen)
    return View(shapes, shining, len(shapes), origins, targets - origins, share)


SHARES = {"tiles": 1, "triangles": 1, "mesh": 4}
"""A rectangle a wall; two triangles; 32 triangles a wall, which are in a tree."""

X, Y, Z = (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.0)
LOW = (-1, -1, -1)
FACES = ((LOW, X, Y), (LOW, Y, Z), (LOW, Z, X), ((-1, -1, 1), X, Y), ((1, -1, -1), Y, Z), ((-1, 1, -1), Z, X))
"""Corner and edges of the walls of a cube, two units wide about the origin."""
CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def wall(kind: str, place: Place, parts: Any, material: str = "plain") -> list[Json]:
    """One wall by its corner and edges, in the place's steps."""
    corner, first, second = (np.array(part, dtype=np.float64) for part in parts)
    if kind == "tiles":
        return [rectangle(place.at(*corner), place.way(*first), place.way(*second), material=material)]
    steps = np.linspace(0, 1, SHARES[kind] + 1)
    u, v = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    vertices = place.at(*(corner + np.outer(u, first) + np.outer(v, second)).T)
    _, faces = grid(place, steps, 0.0)
    return [{**shape, "material": material} for shape in triangulated(kind, vertices, faces)]


def rising(kind: str, place: Place, angle: float) -> list[Json]:
    """A wall six units wide that rises at an angle from a line of eight units."""
    return wall(kind, place, ((0, 0, -4), (0, 0, 8), (6 * np.cos(angle), 6 * np.sin(angle), 0)))


def room(kind: str, place: Place, mirrors: Sequence[int] = ()) -> list[Json]:
    """Six walls that share corners bit for bit, some of them mirrors."""
    return [
        shape
        for number, face in enumerate(FACES)
        for shape in wall(kind, place, face, "mirror" if number in mirrors else "plain")
    ]


def corner_targets(chosen: np.random.Generator, count: int) -> Floats:
    """Places (N, 3) on the lines where walls meet and beside them by 1e-17 and more, and the corners."""
    edges = [(a, b) for a, b in itertools.combinations(CORNERS, 2) if np.count_nonzero(a != b) == 1]
    lines = np.concatenate([a + np.outer(chosen.uniform(0, 1, count), b - a) for a, b in edges])
    beside = lines * (1 - 10 ** chosen.uniform(-17, -1, (len(lines), 1)))
    return np.concatenate((lines, beside, CORNERS))


def seen_in_room(
    shapes: list[Json], place: Place, chosen: np.random.Generator, quality: FixedQuality, pattern: str
) -> Floats:
    """Radiance (N,) along paths to corner lines of a room, of a bulb and a lamp in it and nothing else."""
    mirror = phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.9, max_depth=8)
    edges = place.way(0.1, 0, 0), place.way(0, 0.1, 0.02)
    document = dark_scene(
        *shapes,
        lights=[bulb(place.at(0.3, -0.2, 0.1)), lamp(place.at(0.2, 0.1, 0.3), *edges, visible=False)],
        materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1), "mirror": mirror},
        sampling=sampled(1, 9, light=pattern),
    )
    eye = place.at(-0.4, 0.35, 0.45)
    directions = (place.at(*corner_targets(chosen, 6).T) - eye).T
    return radiance(plan_of(document, quality), rays_of(eye[:, None], directions), Counter())[0]
