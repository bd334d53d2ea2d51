"""Floors, covers, rooms and lights, anywhere and of any size, with what is seen from where."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
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
from accuracy.hard_cases.harness import compiled, png, rays_of, tally
from renderer.integrator import radiance
from renderer.math.arrays import Floats
from schemas.quality import FixedQuality

OFFSETS = (0.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
"""Distances of the scene from the origin, in shares of its own size."""

SCALES = tuple(2.0**exponent for exponent in (-20, -10, 0, 10, 20))
PATTERNS = ("uniform", "random", "stratified", "sobol")

FLOORS = ("tiles", "triangles", "mesh", "relief")
"""Four parallelograms, 8 triangles, a mesh of 72, which are in a tree, and a displaced rectangle."""

COVERS = ("rectangle", "triangles", "mesh", "ellipsoid")

RELIEF = {
    "white": {"type": "image", "asset": "white", "encoding": "linear", "filter": "bilinear", "wrap": "clamp"}
}
WHITE = {"white": png(np.full((2, 2), 255, dtype=np.uint8))}


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A frame that a scene is written in.

    Attributes
    ----------
    center : (3,) float64
    axes : (3, 3) float64
        Unit rows: across, along and up.
    unit : float
        Length of 1, scene units.
    """

    center: Floats
    axes: Floats
    unit: float

    def way(self, *steps: Any) -> Floats:
        """A vector, or vectors (N, 3), by steps across, along and up."""
        return self.unit * np.stack(np.broadcast_arrays(*steps), axis=-1) @ self.axes

    def at(self, *steps: Any) -> Floats:
        """A place, or places (N, 3), by steps from the centre."""
        return self.center + self.way(*steps)


def turned(chosen: np.random.Generator) -> Floats:
    """Three perpendicular unit vectors as rows."""
    return np.linalg.qr(chosen.normal(size=(3, 3)))[0].T


def places(
    name: str, offsets: Sequence[float] = OFFSETS, scales: Sequence[float] = (1.0,), turns: int = 1
) -> Iterator[tuple[np.random.Generator, Place]]:
    """Places at all offsets and of all scales, each with numbers to draw more from."""
    for number, (offset, unit, _) in enumerate(itertools.product(offsets, scales, range(turns))):
        chosen = np.random.default_rng([number, *name.encode()])
        center = chosen.normal(size=3) * offset * unit
        yield chosen, Place(center, turned(chosen), unit)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Rays on a scene, and how much of each light is seen from where they end.

    Attributes
    ----------
    shapes, lights : list of dict
        Of the scene language.
    floors : int
        So many of the shapes, the first ones, are what the rays have to hit.
    origins, directions : (N, 3) float64
    seen : (N, lights) float64
        Share of each light, 0 to 1.
    changes : dict
        Of the rest of the scene.
    """

    shapes: list[Json]
    lights: list[Json]
    floors: int
    origins: Floats
    directions: Floats
    seen: Floats
    changes: Json = field(default_factory=dict)

    def hits(self, quality: FixedQuality, pattern: str = "uniform", points: int = 9) -> renderer.Hits:
        """What Penumbra says of the rays."""
        sampling = sampled(1, points, light=pattern)
        document = scene(*self.shapes, lights=self.lights, sampling=sampling, **self.changes)
        return renderer.trace(compiled(document, quality, WHITE), self.origins, self.directions)

    def wrong(self, quality: FixedQuality, pattern: str = "uniform", points: int = 9) -> int:
        """Pairs of ray and light of which Penumbra says something else."""
        hits = self.hits(quality, pattern, points)
        on_floor = (hits.shape >= 0) & (hits.shape < self.floors)
        return tally((hits.visibility != self.seen) | ~on_floor[:, None])


def floor(kind: str, place: Place) -> list[Json]:
    """Ten units square, flat, made of neighbours that share corners."""
    sides = {"tiles": 2, "triangles": 2, "mesh": 6, "relief": 1}[kind]
    steps = np.linspace(-5, 5, sides + 1)
    if kind in ("tiles", "relief"):
        edges = place.way(10 / sides, 0, 0), place.way(0, 10 / sides, 0)
        corners = [place.at(x, y, 0).tolist() for x in steps[:-1] for y in steps[:-1]]
        material = "relief" if kind == "relief" else "plain"
        return [rectangle(corner, *edges, material=material) for corner in corners]
    vertices, faces = grid(place, steps, 0.0)
    return triangulated(kind, vertices, faces)


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


def relief(place: Place) -> Json:
    """What a scene says of a floor that is displaced by a tenth of a unit everywhere."""
    above = place.at(0, 0, 9)
    return {
        "textures": RELIEF,
        "materials": {
            "plain": phong(),
            "relief": phong(displacement_map="white", displacement_height=place.unit / 10),
        },
        "camera": camera(position=above, look_at=place.center, up=place.axes[1]),
    }


def cover(kind: str, place: Place, middle: Floats) -> list[Json]:
    """Eighteen units wide and flat, about a place above the floor."""
    here = Place(middle, place.axes, place.unit)
    if kind == "rectangle":
        edges = place.way(18, 0, 0), place.way(0, 18, 0)
        return [rectangle(here.at(-9, -9, 0), *edges)]
    if kind == "ellipsoid":
        height = float(np.linalg.norm((middle - place.center) @ place.axes[2])) / place.unit
        axes = (place.way(12, 0, 0), place.way(0, 12, 0), place.way(0, 0, height / 4))
        return [ellipsoid(middle, *axes)]
    steps = np.linspace(-9, 9, 2 if kind == "triangles" else 6)
    return triangulated(kind, *grid(here, steps, 0.0))


def lights(place: Place, way: Floats) -> list[Json]:
    """A bulb, a lamp and a sun in one direction."""
    position = place.center + way
    first, second = place.way(0.1, 0, 0), place.way(0, 0.1, 0)
    return [bulb(position), lamp(position, first, second, visible=False), sun(-way)]


def bare(kind: str, place: Place, chosen: np.random.Generator, count: int = 40) -> View:
    """A floor and nothing above it, seen and lit at angles down to 3e-3: all lights are seen whole."""
    angle = 10 ** chosen.uniform(-2.5, 0)
    high = 0.1 if kind == "relief" else 0.0
    shapes = [*floor(kind, place)]
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle) + high)
    view = 10 ** chosen.uniform(-2.5, 0, count)
    return _viewed(place, shapes, lights(place, way), 1.0, (_spread(chosen, count), view, high))


def on_seams(kind: str, place: Place, chosen: np.random.Generator) -> View:
    """The same, seen exactly on the lines where the parts of the floor meet, as well as doubles can say."""
    sides = {"tiles": 2, "triangles": 2, "mesh": 6}[kind]
    inner = chosen.choice(np.linspace(-5, 5, sides + 1)[1:-1], 20)
    along = chosen.uniform(-3, 3, 20)
    # Across the floor, along it, from corner to corner of the cells, and the corners themselves.
    x = np.concatenate((inner, along, along, inner[:5]))
    y = np.concatenate((along, inner, along, inner[:5]))
    angle, view = 10 ** chosen.uniform(-2.5, 0), 10 ** chosen.uniform(-2.5, 0, x.size)
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle))
    return _viewed(place, floor(kind, place), lights(place, way), 1.0, (np.stack((x, y)), view, 0.0))


def covered(kind: str, above: str, share: float, place: Place, chosen: np.random.Generator) -> View:
    """A floor under a cover at a share of the way to the lights: none is seen."""
    angle = chosen.uniform(0.1, 1.5)
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle))
    shapes = [*floor(kind, place)]
    height = share * 8 * np.sin(angle)
    view = 10 ** chosen.uniform(-2.5, -0.5, 40) * min(1.0, height)
    found = _viewed(place, shapes, lights(place, way), 0.0, (_spread(chosen, 40), view, 0.0))
    return replace(found, shapes=[*found.shapes, *cover(above, place, place.center + share * way)])


def partly_covered(kind: str, above: str, place: Place, chosen: np.random.Generator) -> View:
    """A floor under a cover that ends above its middle, and a lamp as wide as half of what is seen of it.

    What share of the lights is seen is not said.
    """
    shining = lights(place, place.way(0.5, 0.25, 6))
    first, second = place.way(3, 0, 0), place.way(0, 3, 0)
    shining.append(lamp(place.at(-1, -1, 5), first, second, visible=False))
    high = 0.1 if kind == "relief" else 0.0
    view = chosen.uniform(0.1, 1, 40)
    found = _viewed(place, floor(kind, place), shining, np.nan, (_spread(chosen, 40), view, high))
    middle = place.at({"ellipsoid": 12.0}.get(above, 9.0), 0, 2)
    return replace(found, shapes=[*found.shapes, *cover(above, place, middle)])


def _spread(chosen: np.random.Generator, count: int) -> Floats:
    """Places (2, N) across and along the middle of a floor."""
    return chosen.uniform(-3, 3, (2, count))


def _viewed(
    place: Place, shapes: list[Json], shining: list[Json], seen: float, drawn: tuple[Floats, Floats, float]
) -> View:
    """Rays at places (2, N) of a floor, from `view` above it and a unit along."""
    (x, y), view, high = drawn
    targets = place.at(x, y, high)
    origins = targets + place.way(0, 0.5 * np.cos(view), 0.5 * np.sin(view))
    changes = relief(place) if high else {}
    share = np.full((view.size, len(shining)), seen)
    return View(shapes, shining, len(shapes), origins, targets - origins, share, changes)


WALLS = ("tiles", "triangles", "mesh")
"""A rectangle a wall; two triangles; 32 triangles a wall, which are in a tree."""

SHARES = {"tiles": 1, "triangles": 1, "mesh": 4}

X, Y, Z = (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.0)
FACES = (
    ((-1, -1, -1), X, Y),
    ((-1, -1, -1), Y, Z),
    ((-1, -1, -1), Z, X),
    ((-1, -1, 1), X, Y),
    ((1, -1, -1), Y, Z),
    ((-1, 1, -1), Z, X),
)
"""Corner and edges of the walls of a cube, two units wide about the origin."""

CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
EYE = np.array([-0.4, 0.35, 0.45])
LAMP = np.array([0.2, 0.1, 0.3])


def wall(kind: str, place: Place, number: int, material: str) -> list[Json]:
    """One wall; neighbours share their corners bit for bit."""
    corner, first, second = (np.array(part, dtype=np.float64) for part in FACES[number])
    if kind == "tiles":
        edges = place.way(*first), place.way(*second)
        return [rectangle(place.at(*corner), *edges, material=material)]
    steps = np.linspace(0, 1, SHARES[kind] + 1)
    u, v = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    vertices = place.at(*(corner + np.outer(u, first) + np.outer(v, second)).T)
    _, faces = grid(place, steps, 0.0)
    return [{**shape, "material": material} for shape in triangulated(kind, vertices, faces)]


def room(kind: str, place: Place, mirrors: Sequence[int] = ()) -> list[Json]:
    """Six walls, some of them mirrors."""
    return [
        shape
        for number in range(6)
        for shape in wall(kind, place, number, "mirror" if number in mirrors else "plain")
    ]


def corner_targets(chosen: np.random.Generator, count: int) -> Floats:
    """Places (N, 3) on the lines where walls meet and beside them by 1e-17 and more, and the corners."""
    edges = [(a, b) for a, b in itertools.combinations(CORNERS, 2) if tally(a != b) == 1]
    lines = np.concatenate([a + np.outer(chosen.uniform(0, 1, count), b - a) for a, b in edges])
    beside = lines * (1 - 10 ** chosen.uniform(-17, -1, (len(lines), 1)))
    return np.concatenate((lines, beside, CORNERS))


def inner_lights(place: Place) -> list[Json]:
    """A bulb and a lamp in the room."""
    edges = place.way(0.1, 0, 0), place.way(0, 0.1, 0.02)
    return [bulb(place.at(0.3, -0.2, 0.1)), lamp(place.at(*LAMP), *edges, visible=False)]


def outer_lights(place: Place) -> list[Json]:
    """Lamps and a bulb outside of the room, near its corner lines."""
    return [
        lamp(place.at(-2, -2, -2), place.way(4, 0, 0), place.way(0, 0, 4)),
        lamp(place.at(-2, -2, 1.25), place.way(4, 0, 0), place.way(0, 4, 0)),
        bulb(place.at(1.5, 1.25, 1.125)),
    ]


def seen_in_room(
    shapes: list[Json],
    place: Place,
    chosen: np.random.Generator,
    quality: FixedQuality,
    *,
    shining: list[Json],
    pattern: str = "uniform",
    count: int = 6,
    depth: int = 8,
) -> Floats:
    """Radiance (N,) along paths from a place in the room to its corner lines; nothing but lights shines."""
    document = dark_scene(
        *shapes,
        lights=shining,
        materials={
            "plain": phong([1, 1, 1], ambient=0, diffuse=1),
            "mirror": phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.9, max_depth=depth),
        },
        sampling=sampled(1, 9, light=pattern),
    )
    plan = compiled(document, quality)
    targets = corner_targets(chosen, count)
    eye = place.at(*EYE)
    directions = np.ascontiguousarray((place.at(*targets.T) - eye).T)
    return radiance(plan, rays_of(eye[:, None], directions), Counter())[0]
