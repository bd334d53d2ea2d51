"""Triangles and parallelograms: thin, tiny, huge, far, grazed ones against rational numbers; shared edges."""

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import renderer
from tests.documents import Json, mesh, rectangle, scene, triangle
from tests.numerics import families
from tests.numerics.families import between, grazing, rectangles, triangles
from tests.numerics.judging import assert_right, flat_details, rounded
from tests.numerics.oracle import Answer
from tests.numerics.tracing import EPS, traced
from tests.pictures.parts import plan_of

Floats = np.ndarray
FAMILIES = {
    "slivers": lambda: triangles(families.sliver),
    "triangles of any size": lambda: triangles(families.any_size),
    "far from the origin": lambda: triangles(families.offset),
    "long rays": lambda: triangles(families.ordinary, between(3, 6.5)),
    "grazing": lambda: grazing("triangle"),
    "skew": lambda: rectangles(families.skew),
    "long and narrow": lambda: rectangles(families.long_and_narrow),
    "rectangles of any size": lambda: rectangles(families.any_size),
    "grazing a rectangle": lambda: grazing("rectangle"),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_flat_shape_is_hit_as_exact_numbers_say(name: str) -> None:
    assert_right(FAMILIES[name](), from_afar if name == "long rays" else flat_details, rounded)


def from_afar(shape: Any, true: Answer, ray: Any, found: Any) -> float:
    """A long ray ends on the plane within 8 roundings of a vertex, not of the ray's length."""
    off = abs(float(np.dot(found[0] - true.position, true.normal)))
    return max(off / (8 * EPS * float(np.abs(shape.vertices).max())), flat_details(shape, true, ray, found))


def test_triangle_without_area_is_dropped_and_counted() -> None:
    """On lines or in points: half of whole numbers in many units, half of doubles times powers of two."""
    rng = np.random.default_rng(1)
    unit = 2.0 ** rng.integers(-20, 20, (100, 1, 1))
    starts, ways = rng.integers(-20, 21, (2, 100, 1, 3)).astype(float)
    steps = rng.integers(-9, 10, (100, 3, 1)).astype(float)
    steps[::10] = steps[::10, :1]
    starts[1::2] = 0
    ways[1::2] = rng.normal(size=(50, 1, 3))
    steps[1::2] = rng.choice([-1, 1], (50, 3, 1)) * 2.0 ** rng.integers(0, 5, (50, 3, 1))
    corners = (starts + steps * ways) * unit
    targets = (starts + rng.uniform(-9, 9, (100, 10, 1)) * ways) * unit
    away = rng.normal(size=(100, 10, 3)) * 100 * unit
    together = mesh(corners.reshape(-1, 3), np.arange(300).reshape(-1, 3))
    plan = plan_of(scene(together, *(triangle(*rows) for rows in corners)))
    assert plan.numerics["degenerate_dropped"] == 200
    hits = renderer.trace(plan, (targets + away).reshape(-1, 3), -away.reshape(-1, 3))
    assert (hits.shape == -1).all()


def planes(seed: int, reach: int) -> Iterator[tuple[Floats, np.random.Generator]]:
    """Corners and two edges (3, 3) of whole numbers, not parallel."""
    rng = np.random.default_rng(seed)
    drawn = (rng.integers(-reach, reach + 1, (3, 3)).astype(float) for _ in itertools.count())
    yield from itertools.islice(((part, rng) for part in drawn if np.cross(part[1], part[2]).any()), 100)


def flat(kind: str, parts: Floats) -> Json:
    corner, first, second = parts
    return rectangle(*parts) if kind == "rectangle" else triangle(corner, corner + first, corner + second)


@pytest.mark.parametrize("kind", ["triangle", "rectangle"])
def test_ray_along_the_plane_misses_or_hits_within(kind: str) -> None:
    for parts, rng in planes(1, reach=20):
        corner, edges = parts[0], parts[1:]
        directions = rng.integers(-9, 10, (10, 2)) @ edges
        directions[~directions.any(axis=1)] = edges[0]
        beside = rng.choice([-2, -1, 1, 2], 10) * (np.arange(10) % 2)
        origins = corner + rng.integers(-9, 10, (10, 2)) @ edges + np.outer(beside, np.cross(*edges))
        t = traced([flat(kind, parts)], origins, directions).t
        assert (t[beside != 0] == np.inf).all()
        corners = corner + np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) @ edges
        depths = ((corners[:, None] - origins) * directions).sum(axis=2) / (directions**2).sum(axis=1)
        low, high = depths.min(axis=0), depths.max(axis=0)
        margin = (high - low) / 1000
        assert (np.isinf(t) | ((low - margin <= t) & (t <= high + margin))).all()


@pytest.mark.parametrize("kind", ["triangle", "rectangle"])
def test_ray_that_starts_on_a_flat_shape_misses_it(kind: str) -> None:
    """Products of three of these whole numbers are rounded."""
    for parts, rng in planes(2, reach=2**19):
        shares = rng.integers(0, 9, (10, 2)) / 8
        if kind == "triangle":
            beyond = shares.sum(axis=1) > 1
            shares[beyond] = 1 - shares[beyond]
        origins = parts[0] + shares @ parts[1:]
        assert (traced([flat(kind, parts)], origins, rng.normal(size=(10, 3))).t == np.inf).all()


Surface = tuple[list[Json], Floats, Floats]
"""Neighbours, and origins and targets of rays at what they share."""


def exact_pairs() -> Iterator[Surface]:
    """Two triangles of whole numbers, with rays that hit their edge without any rounding."""
    rng = np.random.default_rng(2)
    for _ in range(60):
        a, d = rng.integers(-160, 161, (2, 3))
        b, along = rng.integers(-160, 161, 3), rng.integers(-20, 21, 3)
        ways = rng.integers(-160, 161, (100, 3))
        # The planes of edge and ray that have the one triangle on this side and the other on that.
        normals = np.cross(ways, along)
        parted = (normals @ (a - b)) * (normals @ (d - b)) < 0
        targets, c = b + np.outer(rng.integers(1, 8, 100), along)[parted], b + 8 * along
        yield [triangle(a, b, c), triangle(d, c, b)], targets - 3.0 * ways[parted], targets


def fans() -> Iterator[Surface]:
    """Six triangles around an apex, anywhere, and rays at the apex."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        apex = rng.normal(size=3) * 5
        turns = (np.arange(6) + rng.uniform(0, 0.8, 6)) * np.pi / 3
        ring = apex + np.column_stack((np.cos(turns), np.sin(turns), rng.uniform(-0.3, 0.3, 6)))
        origins = apex + [0, 0, 4] + rng.normal(size=(20, 3)) * 0.5
        sides = zip(ring, np.roll(ring, -1, axis=0), strict=True)
        yield [triangle(apex, *side) for side in sides], origins, np.broadcast_to(apex, origins.shape)


def sheets() -> Iterator[Surface]:
    """Four parallelograms of whole numbers around a corner; rays hit edges and that corner exactly."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        corner, first, second = rng.integers(-20, 21, (3, 3)) * 8.0
        shares = np.stack((np.ones(40), rng.integers(1, 9, 40) / 8), axis=1)
        shares[::2] = shares[::2, ::-1]
        targets, ways = corner + shares @ np.array([first, second]), rng.integers(-160, 161, (40, 3))
        across = ways @ np.cross(first, second) != 0
        places = (corner + i * first + j * second for i, j in itertools.product((0, 1), repeat=2))
        shapes = [rectangle(place, first, second) for place in places]
        yield shapes, (targets - 3 * ways)[across], targets[across]


@pytest.mark.parametrize("surfaces", [exact_pairs, fans, sheets])
def test_shared_edge_or_vertex_lets_no_ray_through(surfaces: Callable[[], Iterator[Surface]]) -> None:
    for shapes, origins, targets in surfaces():
        assert (traced(shapes, origins, targets - origins).shape >= 0).all()
