"""Hits against exact arithmetic, on rays that are each hard in one way."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from renderer.hard_cases import oracle
from renderer.hard_cases.documents import ellipsoid, rectangle, scene, sphere, triangle
from renderer.hard_cases.families import FAMILIES
from schemas.reading import read_scene
from tests.numerics.tracing import EPS, traced

ILL_SHAPED = {"slivers", "needles"}


def feature(shape: Any) -> float:
    """Least height of a flat shape, or shortest semi-axis: what an error of a place is compared with."""
    if shape.type == "ellipsoid":
        return min(math.hypot(*axis) for axis in getattr(shape, "axes", [(shape.__dict__.get("radius", 0),)]))
    if shape.type == "rectangle":
        edges = np.array(shape.edges)
        return float(np.linalg.norm(np.cross(*edges)) / np.linalg.norm(edges, axis=1).max())
    a, b, c = np.array(shape.vertices)
    longest = max(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c))
    return float(np.linalg.norm(np.cross(b - a, c - a)) / longest)


def longest(triangle: Any) -> float:
    """Its longest edge."""
    return max(math.dist(a, b) for a, b in itertools.combinations(triangle.vertices, 2))


def extent(shape: Any) -> float:
    """Largest number in the shape."""
    numbers = [np.abs(np.array(getattr(shape, name))).max() for name in PARTS if getattr(shape, name, None)]
    return float(max(numbers))


PARTS = ("vertices", "corner", "edges", "center", "axes", "radius")


@pytest.mark.parametrize("family", FAMILIES)
def test_rays_hit_what_exact_arithmetic_says(family: str) -> None:
    """Hit or miss is right beyond 16 roundings from the border, and what a hit says is within roundings.

    With s the largest number of ray and shape, f the shape's least height, l its longest edge and c the
    cosine between ray and normal: t is off by 8 eps s / c along the ray (by 32 eps s l / (f c) in triangles
    of little height, where the weights of the vertices are uncertain), the place by 8 eps s across the
    surface, normal and texture coordinates by 32 eps s / (f c).
    """
    hits = misses = 0
    for document, rays in FAMILIES[family]():
        shape = read_scene(scene(document))[0].shapes[0]
        found = traced([document], [ray[0] for ray in rays], [ray[1] for ray in rays])
        for i, (origin, direction) in enumerate(rays):
            true = oracle.answer(shape, origin, direction)
            if true.hit != (found.shape[i] == 0):
                assert true.margin <= 16 * EPS, (document, origin, direction)
                continue
            hits, misses = hits + true.hit, misses + (not true.hit)
            if not true.hit:
                assert math.isinf(found.t[i])
                continue
            scale = max(*map(abs, origin), extent(shape))
            length = math.hypot(*direction)
            cosine = abs(float(np.dot(true.normal, direction))) / length
            uncertain = 32 * longest(shape) / feature(shape) if family in ILL_SHAPED else 8
            along = uncertain * EPS * scale / cosine
            assert abs(found.t[i] - true.t) * length <= along
            assert abs(np.dot(found.position[i] - true.position, true.normal)) <= 8 * EPS * scale
            assert np.abs(found.normal[i] - true.normal).max() <= 32 * EPS * scale / feature(shape) / cosine
            assert np.abs(found.uv[i] - true.uv).max() <= 32 * EPS * scale / feature(shape) / cosine
            assert found.primitive[i] == 0
    assert hits >= 60 or family == "ellipsoids behind"
    assert misses >= 25 or family in {"the ground", "from inside an ellipsoid"}


LENGTHS = [2e-200, 1e-30, 1e-12, 1.0, 3.7, 1e25, 1e200]
SHAPES = {
    "triangle": triangle([-1.1, -0.3, 0.2], [2.3, -0.7, 0.1], [0.4, 2.9, -0.6]),
    "rectangle": rectangle([-1.1, -0.9, 0.2], [2.3, 0.1, 0.1], [0.4, 2.1, -0.6]),
    "ellipsoid": ellipsoid([0.1, 0.2, 0.3], [1.1, 0, 0], [0, 0.7, 0], [0, 0, 1.9]),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_t_counts_in_units_of_the_direction_whatever_its_length(shape: str) -> None:
    direction = np.array([0.03, -0.02, -0.9])
    directions = np.array([direction * length for length in LENGTHS])
    hits = traced([SHAPES[shape]], np.tile([0.1, 0.4, 5.0], (len(LENGTHS), 1)), directions)
    assert (hits.shape == 0).all()
    distances = hits.t * np.array(LENGTHS)
    assert np.abs(distances / distances[LENGTHS.index(1.0)] - 1).max() <= 8 * EPS
    assert np.ptp(hits.position, axis=0).max() <= 8 * EPS


@pytest.mark.parametrize("shape", SHAPES)
def test_rays_that_are_none_miss(shape: str) -> None:
    nan, inf = math.nan, math.inf
    good = [0.1, 0.4, 5.0]
    rays = [
        (good, [0, 0, 0]),
        (good, [0, -0.0, 0]),
        (good, [nan, 0, -1]),
        (good, [0, 0, -inf]),
        ([nan, 0, 5], [0, 0, -1]),
        ([0, inf, 5], [0, 0, -1]),
        (good, [0, 0, -1]),
    ]
    hits = traced([SHAPES[shape]], *zip(*rays, strict=True))
    assert hits.shape.tolist() == [-1] * 6 + [0]
    assert np.isinf(hits.t[:6]).all()
    assert np.isnan(hits.position[:6]).all()
    assert np.isnan(hits.normal[:6]).all()
    assert np.isnan(hits.uv[:6]).all()
    assert np.isfinite(hits.position[6]).all()


@pytest.mark.parametrize("sign", [0.0, -0.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_sign_of_zero_says_nothing(shape: str, sign: float) -> None:
    hits = traced([SHAPES[shape]], [[0.2, 0.3, 5]], [[sign, sign, -1]])
    plain = traced([SHAPES[shape]], [[0.2, 0.3, 5]], [[0, 0, -1]])
    assert hits.t == plain.t
    assert (hits.uv == plain.uv).all()


def test_a_ray_through_the_very_middle_of_a_triangle_hits_it() -> None:
    # All three edge functions are the same number there.
    found = traced([triangle([3, 0, 0], [0, 3, 0], [0, 0, 3])], [(0, 0, 0)], [(1, 1, 1)])
    assert found.t.tolist() == [1]
    assert found.uv.tolist() == [[1 / 3, 1 / 3]]


PARALLEL = [
    triangle([0, 0, 0], [4, 0, 0], [0, 4, 0]),
    rectangle([0, 0, 0], [4, 0, 0], [0, 4, 0]),
]


@pytest.mark.parametrize("shape", PARALLEL, ids=["triangle", "rectangle"])
@pytest.mark.parametrize("height", [0, 1, -3])
def test_a_ray_parallel_to_a_plane_or_in_it_misses(shape: Any, height: int) -> None:
    rng = np.random.default_rng(2)
    origins = np.column_stack((rng.integers(-9, 9, (500, 2)), np.full(500, height)))
    directions = np.column_stack((rng.integers(-9, 9, (500, 2)), np.zeros(500)))
    assert (traced([shape], origins, directions).shape == -1).all()


@pytest.mark.parametrize("power", [-30, 0, 30])
@pytest.mark.parametrize("place", [(7, 24, 0), (-15, 0, 20), (9, 12, 20), (12, -15, 16), (0, 0, -25)])
def test_a_ray_that_starts_on_a_sphere_leaves_it_or_goes_through(place: tuple[int, ...], power: int) -> None:
    """Whole numbers on the sphere of radius 25, without any rounding."""
    unit = 2.0**power
    origin = np.array(place) * unit
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(400, 3))
    hits = traced([sphere([0, 0, 0], 25 * unit)], np.tile(origin, (400, 1)), directions)
    inwards = directions @ origin < 0
    assert (hits.shape[~inwards] == -1).all()
    assert (hits.shape[inwards] == 0).all()
    chord = -2 * (directions @ origin) / (directions**2).sum(axis=1)
    lengths = np.linalg.norm(directions, axis=1)
    cosine = np.abs(directions @ origin) / lengths / (25 * unit)
    error = np.abs(hits.t - chord)[inwards] * (lengths * cosine)[inwards]
    assert error.max() <= 8 * EPS * 25 * unit


def test_a_ray_that_touches_a_sphere_gives_no_nan() -> None:
    hits = traced([sphere([0, 0, 0], 5)], [[3, 4, -10]], [[0, 0, 1]])
    assert hits.shape == -1 or abs(hits.t - 10) <= 4e-7


def test_a_shape_behind_the_start_is_not_hit() -> None:
    for shape in SHAPES.values():
        assert traced([shape], [[0.1, 0.4, 5.0]], [[0, 0, 1]]).shape == -1


@pytest.mark.parametrize("order", [1, -1])
def test_of_equal_distances_the_first_shape_wins(order: int) -> None:
    """Whole numbers: the distance is exactly 4 to all of them, of three kinds, in any order."""
    shapes = [
        triangle([-2, -2, 0], [2, -2, 0], [0, 2, 0]),
        rectangle([-2, -2, 0], [4, 0, 0], [0, 4, 0]),
        sphere([0, 0, -1], 1),
        rectangle([-2, -2, 0], [0, 4, 0], [4, 0, 0]),
        triangle([2, -2, 0], [-2, -2, 0], [0, 2, 0]),
    ]
    hits = traced(shapes[::order], [[0, 0, 4]], [[0, 0, -1]])
    assert (hits.shape.tolist(), hits.t.tolist()) == ([0], [4.0])


def test_the_normal_is_on_the_side_the_ray_comes_from() -> None:
    for shape in SHAPES.values():
        origins, directions = (
            [[0.1, 0.4, 5.0], [0.1, 0.4, -5.0], [0.1, 0.2, 0.3]],
            [[0, 0, -1], [0, 0, 1], [0, 0, 1]],
        )
        hits = traced([shape], origins, directions)
        found = hits.shape == 0
        assert found[:2].all()
        assert ((hits.normal * np.array(directions)).sum(axis=1)[found] < 0).all()


def test_a_ray_is_answered_the_same_alone_and_among_thousands() -> None:
    rng = np.random.default_rng(5)
    origins, targets = rng.normal(size=(20000, 3)) * 6, rng.normal(size=(20000, 3))
    together = traced(list(SHAPES.values()), origins, targets - origins)
    for i in [0, 1, 8191, 8192, 8193, 19999]:
        alone = traced(list(SHAPES.values()), origins[i : i + 1], (targets - origins)[i : i + 1])
        for name in ("t", "position", "normal", "uv", "shape"):
            assert getattr(alone, name)[0].tobytes() == getattr(together, name)[i].tobytes()


@pytest.mark.parametrize(
    ("origins", "directions", "message"),
    [
        ([0, 0, 5], [0, 0, -1], r"origins must have the shape \(N, 3\), not \(3,\)"),
        ([[0, 0, 5]], [[0, -1]], r"directions must have the shape \(N, 3\), not \(1, 2\)"),
        ([[0, 0, 5]], [[0, 0, -1]] * 2, "origins have 1 rows and directions 2"),
    ],
)
def test_arrays_of_another_shape_are_refused(origins: Any, directions: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        traced([SHAPES["triangle"]], origins, directions)


def test_no_rays_are_no_hits() -> None:
    hits = traced([SHAPES["triangle"]], np.zeros((0, 3)), np.zeros((0, 3)))
    assert hits.t.shape == (0,)
    assert hits.visibility.shape == (0, 0)


@pytest.mark.parametrize(
    ("place", "uv"),
    [
        ([1, 0, 0], (0, 0.5)),
        ([0, 1, 0], (0.25, 0.5)),
        ([-1, 0, 0], (0.5, 0.5)),
        ([0, -1, 0], (0.75, 0.5)),
        ([0, 0, 1], (0, 1)),
        ([0, 0, -1], (0, 0)),
    ],
)
def test_longitude_starts_at_the_first_axis_and_latitude_below(
    place: list[int], uv: tuple[float, float]
) -> None:
    hits = traced([sphere([0, 0, 0], 1)], [[3.0 * x for x in place]], [[-1.0 * x for x in place]])
    assert tuple(hits.uv[0]) == uv
