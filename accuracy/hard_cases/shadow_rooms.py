"""Closed rooms anywhere and of any size, with mirrors among the walls, and rays at their corners."""

import itertools
from collections import Counter
from collections.abc import Sequence

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, bulb, lamp, phong, rectangle, sampled, scene
from accuracy.hard_cases.shadow_scenes import Place, grid, triangulated
from renderer.integrator import radiance
from renderer.interaction import Rays
from renderer.math.arrays import Floats
from schemas.quality import FixedQuality

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
        edges = place.way(*first).tolist(), place.way(*second).tolist()
        return [rectangle(place.at(*corner).tolist(), *edges, material=material)]
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
    edges = [(a, b) for a, b in itertools.combinations(CORNERS, 2) if np.count_nonzero(a != b) == 1]
    lines = np.concatenate([a + np.outer(chosen.uniform(0, 1, count), b - a) for a, b in edges])
    beside = lines * (1 - 10 ** chosen.uniform(-17, -1, (len(lines), 1)))
    return np.concatenate((lines, beside, CORNERS))


def inner_lights(place: Place) -> list[Json]:
    """A bulb and a lamp in the room."""
    edges = place.way(0.1, 0, 0).tolist(), place.way(0, 0.1, 0.02).tolist()
    return [bulb(place.at(0.3, -0.2, 0.1).tolist()), lamp(place.at(*LAMP).tolist(), *edges, visible=False)]


def outer_lights(place: Place) -> list[Json]:
    """Lamps and a bulb outside of the room, near its corner lines."""
    return [
        lamp(place.at(-2, -2, -2).tolist(), place.way(4, 0, 0).tolist(), place.way(0, 0, 4).tolist()),
        lamp(place.at(-2, -2, 1.25).tolist(), place.way(4, 0, 0).tolist(), place.way(0, 4, 0).tolist()),
        bulb(place.at(1.5, 1.25, 1.125).tolist()),
    ]


def seen_in_room(
    shapes: list[Json],
    place: Place,
    chosen: np.random.Generator,
    precision: FixedQuality,
    *,
    shining: list[Json],
    pattern: str = "uniform",
    count: int = 6,
    depth: int = 8,
) -> Floats:
    """Radiance (N,) along paths from a place in the room to its corner lines; nothing but lights shines."""
    document = scene(
        *shapes,
        lights=shining,
        ambient=[0, 0, 0],
        background=[0, 0, 0],
        materials={
            "plain": phong([1, 1, 1], ambient=0, diffuse=1),
            "mirror": phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.9, max_depth=depth),
        },
        sampling=sampled(1, 9, light=pattern),
    )
    plan = renderer.compile_scene(renderer.load_scene(document), precision)
    targets = corner_targets(chosen, count)
    eye = place.at(*EYE)
    directions = np.ascontiguousarray((place.at(*targets.T) - eye).T)
    numbers = np.arange(len(targets))
    rays = Rays(eye[:, None], directions, numbers, np.zeros_like(numbers))
    return radiance(plan, rays, Counter())[0]
