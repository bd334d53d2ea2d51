"""Triangles: thin, tiny, huge, far, grazing ones against rational numbers; shared edges and vertices."""

import itertools

import numpy as np
import pytest

import renderer
from tests.documents import mesh, rectangle, scene, triangle
from tests.numerics import families, oracle
from tests.numerics.families import between, ordinary, triangles
from tests.numerics.judging import assert_right, flat_details, rounded
from tests.numerics.tracing import EPS, read_shape, traced
from tests.pictures.parts import plan_of

Floats = np.ndarray
FAMILIES = {
    "ordinary": lambda: triangles(ordinary),
    "slivers": lambda: triangles(families.sliver),
    "needles": lambda: triangles(families.needle),
    "tiny": lambda: triangles(families.tiny),
    "huge": lambda: triangles(families.huge),
    "far from the origin": lambda: triangles(families.offset),
    "long rays": lambda: triangles(ordinary, between(3, 6.5)),
    "grazing": lambda: families.grazing("triangle"),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_triangle_is_hit_as_exact_numbers_say(name: str) -> None:
    assert_right(FAMILIES[name](), flat_details, rounded)


def test_long_ray_ends_on_the_plane() -> None:
    """Within 8 roundings of the largest coordinate of a vertex, not of the ray's length."""
    for document, rays in itertools.islice(FAMILIES["long rays"](), 20):
        shape = read_shape(document)
        found = traced([document], *np.array(rays).transpose(1, 0, 2)).position
        for ray, place in zip(rays, found, strict=True):
            true = oracle.answer(shape, *ray)
            if true.hit:
                off = abs(np.dot(place - true.position, true.normal))
                assert off <= 8 * EPS * np.abs(shape.vertices).max()


REGRESSION = np.array(
    [
        [-1113.45459, -79.049614, -56.2431908],
        [-1113.45459, -87.0922699, -56.2431908],
        [-1113.45459, -79.2090149, -56.2431908],
    ]
)
"""On one line; pbrt-v4 once reported a hit by this ray:"""
REGRESSION_RAY = ([-1081.47925, 99.9999542, 87.7701111], [-32.1072998, -183.355865, -144.607635])


def on_lines() -> tuple[Floats, Floats, Floats]:
    """Triangles (100, 3, 3) exactly on lines or in points, and ten rays at each: (1000, 3).

    Half of whole numbers in many units; half of doubles times powers of two, whose differences are rounded.
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


def test_triangle_without_area_is_dropped_and_counted() -> None:
    corners, origins, targets = on_lines()
    everything = np.concatenate((corners, [REGRESSION]))
    together = mesh(everything.reshape(-1, 3), np.arange(303).reshape(-1, 3))
    plan = plan_of(scene(together, *(triangle(*rows) for rows in everything)))
    assert plan.numerics["degenerate_dropped"] == 202
    hits = renderer.trace(
        plan,
        np.concatenate((origins, [REGRESSION_RAY[0]])),
        np.concatenate((targets - origins, [REGRESSION_RAY[1]])),
    )
    assert (hits.shape == -1).all()


SMALL, LARGE = 20, 2**19
"""Whole numbers whose products of three are exact, and whose are rounded."""


def planes(seed: int, reach: int) -> list[tuple[Floats, np.random.Generator]]:
    """Corners and two edges (3, 3) of whole numbers, not parallel."""
    rng = np.random.default_rng(seed)
    drawn = (rng.integers(-reach, reach + 1, (3, 3)).astype(float) for _ in itertools.count())
    return [(part, rng) for part in itertools.islice((p for p in drawn if np.cross(p[1], p[2]).any()), 100)]


def shape_of(kind: str, parts: Floats) -> dict:
    corner, first, second = parts
    return rectangle(*parts) if kind == "rectangle" else triangle(corner, corner + first, corner + second)


@pytest.mark.parametrize("kind", ["triangle", "rectangle"])
def test_ray_along_the_plane_misses_or_hits_within(kind: str) -> None:
    for parts, rng in planes(1, SMALL):
        corner, edges = parts[0], parts[1:]
        directions = rng.integers(-9, 10, (10, 2)) @ edges
        directions[~directions.any(axis=1)] = edges[0]
        beside = rng.choice([-2, -1, 1, 2], 10) * (np.arange(10) % 2)
        origins = corner + rng.integers(-9, 10, (10, 2)) @ edges + np.outer(beside, np.cross(*edges))
        t = traced([shape_of(kind, parts)], origins, directions).t
        assert (t[beside != 0] == np.inf).all()
        corners = corner + np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) @ edges
        depths = ((corners[:, None] - origins) * directions).sum(axis=2) / (directions**2).sum(axis=1)
        low, high = depths.min(axis=0), depths.max(axis=0)
        margin = (high - low) / 1000
        assert (np.isinf(t) | ((low - margin <= t) & (t <= high + margin))).all()


@pytest.mark.parametrize("kind", ["triangle", "rectangle"])
def test_ray_that_starts_on_a_flat_shape_misses_it(kind: str) -> None:
    for parts, rng in planes(2, LARGE):
        shares = rng.integers(0, 9, (10, 2)) / 8
        if kind == "triangle":
            beyond = shares.sum(axis=1) > 1
            shares[beyond] = 1 - shares[beyond]
        origins = parts[0] + shares @ parts[1:]
        assert (traced([shape_of(kind, parts)], origins, rng.normal(size=(10, 3))).t == np.inf).all()


def pairs() -> list[tuple[Floats, Floats, Floats]]:
    """Two triangles with one edge in common, and rays at places of that edge, rounded."""
    rng, made = np.random.default_rng(1), []
    for _ in range(60):
        a, b, c, d = rng.normal(size=(4, 3))
        d = b + c - a + 0.1 * d
        targets = b + np.outer(rng.uniform(0.05, 0.95, 20), c - b)
        normal = np.cross(b - a, c - a)
        origins = targets + normal / np.linalg.norm(normal) * 3 + rng.normal(size=(20, 3)) * 0.3
        made.append((np.array([[a, b, c], [d, c, b]]), origins, targets))
    return made


def exact_pairs() -> list[tuple[Floats, Floats, Floats]]:
    """The same in whole numbers, with rays that hit the edge without any rounding."""
    rng, made = np.random.default_rng(2), []
    for _ in range(60):
        a, d = rng.integers(-160, 161, (2, 3))
        b, along = rng.integers(-160, 161, 3), rng.integers(-20, 21, 3)
        ways = rng.integers(-160, 161, (100, 3))
        # The planes of edge and ray that have the one triangle on this side and the other on that.
        normals = np.cross(ways, along)
        between_ = (normals @ (a - b)) * (normals @ (d - b)) < 0
        targets, c = b + np.outer(rng.integers(1, 8, 100), along)[between_], b + 8 * along
        parts = np.array([[a, b, c], [d, c, b]], dtype=float)
        made.append((parts, targets - 3.0 * ways[between_], targets))
    return made


def fans() -> list[tuple[Floats, Floats, Floats]]:
    """Six triangles around an apex, anywhere, and rays at the apex."""
    rng, made = np.random.default_rng(3), []
    for _ in range(60):
        apex = rng.normal(size=3) * 5
        turns = (np.arange(6) + rng.uniform(0, 0.8, 6)) * np.pi / 3
        ring = apex + np.column_stack((np.cos(turns), np.sin(turns), rng.uniform(-0.3, 0.3, 6)))
        corners = np.stack((np.broadcast_to(apex, ring.shape), ring, np.roll(ring, -1, axis=0)), axis=1)
        origins = apex + [0, 0, 4] + rng.normal(size=(20, 3)) * 0.5
        made.append((corners, origins, np.broadcast_to(apex, origins.shape)))
    return made


@pytest.mark.parametrize("surfaces", [pairs, exact_pairs, fans])
def test_shared_edge_or_vertex_lets_no_ray_through(surfaces: object) -> None:
    for corners, origins, targets in surfaces():  # type: ignore[operator]
        hits = traced([triangle(*rows) for rows in corners], origins, targets - origins)
        assert (hits.shape >= 0).all()
