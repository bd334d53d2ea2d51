"""Hits where no number decides, and rays of any length from anywhere."""

import math
from typing import Any

import numpy as np
import pytest

from schemas.quantities import LONGEST, MAX_ORIGIN, SHORTEST
from tests.documents import bulb, ellipsoid, lamp, mesh, rectangle, sphere, sun, triangle
from tests.numerics import oracle
from tests.numerics.tracing import QUALITIES, read_shape, traced

BOTH = pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])
CORNERS = np.array([[-1.0, -1, 0.5], [3, -1, 0.25], [-1, 3, 0.75]])
STACK = (CORNERS - np.arange(50)[:, None, None] * [0, 0, 1]).reshape(-1, 3)
SHAPES = {
    "triangle": triangle(*CORNERS),
    "mesh": mesh(STACK, np.arange(150).reshape(-1, 3)),
    "rectangle": rectangle([-1, -1, 0.5], [2, 0, 0.5], [0, 3, 0.25]),
    "ellipsoid": ellipsoid([0, 0, 0], [1, 0, 0], [0, 3, 0], [0, 0, 2]),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_rays_that_are_none_miss(shape: str) -> None:
    nan, inf = math.nan, math.inf
    good = [0.1, 0.4, 5.0]
    rays = [
        (good, [0, 0, 0]),
        (good, [nan, 0, -1]),
        (good, [0, 0, -inf]),
        ([nan, 0, 5], [0, 0, -1]),
        ([0, inf, 5], [0, 0, -1]),
        (good, [0, 0, 1]),
        (good, [0, -0.0, -1]),
    ]
    hits = traced([SHAPES[shape]], *zip(*rays, strict=True))
    assert hits.shape.tolist() == [-1] * 6 + [0]
    assert np.isinf(hits.t[:6]).all()
    for part in (hits.position, hits.normal, hits.uv):
        assert np.isnan(part[:6]).all()
        assert np.isfinite(part[6]).all()


def test_ray_through_the_very_middle_of_a_triangle_hits_it() -> None:
    # All three edge functions are the same number there.
    found = traced([triangle([3, 0, 0], [0, 3, 0], [0, 0, 3])], [(0, 0, 0)], [(1, 1, 1)])
    assert found.t.tolist() == [1]
    assert found.uv.tolist() == [[1 / 3, 1 / 3]]


@pytest.mark.parametrize("order", [1, -1])
def test_first_shape_wins_of_equal_distances(order: int) -> None:
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


@pytest.mark.parametrize("shape", SHAPES)
def test_normal_is_on_the_side_the_ray_comes_from(shape: str) -> None:
    directions = np.array([[0, 0, -1], [0, 0, 1], [0, 0, 1]])
    hits = traced([SHAPES[shape]], [[0.1, 0.4, 5.0], [0.1, 0.4, -90.0], [0.1, 0.2, 0.0]], directions)
    assert (hits.shape == 0).all()
    assert ((hits.normal * directions).sum(axis=1) < 0).all()


def test_no_rays_are_no_hits() -> None:
    hits = traced([SHAPES["triangle"]], np.zeros((0, 3)), np.zeros((0, 3)))
    assert hits.t.shape == (0,)
    assert hits.visibility.shape == (0, 0)


@BOTH
def test_length_of_a_power_of_two_scales_t_and_changes_no_other_bit(quality: Any) -> None:
    """2^-99 and 2^83 are about 1e-30 and 1e25."""
    rng = np.random.default_rng(3)
    origins = rng.normal(size=(200, 3)) * rng.choice([0.3, 4, 100], (200, 1))
    ways, powers = rng.normal(size=(200, 3)) * 0.8 - origins, rng.integers(-99, 84, 200)
    area = lamp([-1.3, 5.1, -0.4], [1.5, 0.1, 0.2], [0.1, 0.3, 1.7])
    lights = [area, bulb([4.2, 3.3, 5.1]), sun([3, -9, 2])]
    shapes = [*SHAPES.values(), rectangle([-9, -2, -9], [0, 0, 18], [18, 0, 0])]
    hits, unit = (
        traced(shapes, origins, np.ldexp(ways, each[:, None]), lights=lights, points=4, quality=quality)
        for each in (powers, 0 * powers)
    )
    assert {*range(5)} <= set(unit.shape)
    assert (np.ldexp(hits.t, powers) == unit.t).all()
    for name in ("position", "normal", "uv", "shape", "primitive", "visibility"):
        assert getattr(hits, name).tobytes() == getattr(unit, name).tobytes()


@pytest.mark.parametrize("length", [SHORTEST, 1.0, LONGEST])
@pytest.mark.parametrize("distance", [2.0**60, MAX_ORIGIN])
@pytest.mark.parametrize("shape", SHAPES)
def test_ray_from_as_far_as_is_allowed_hits_its_aim(shape: str, distance: float, length: float) -> None:
    ray = [0.25, 0.125, distance], [0, 0, -length]
    hits = traced([SHAPES[shape]], [ray[0]], [ray[1]], lights=[bulb([0, 0, 9])])
    true = oracle.answer(read_shape(SHAPES["triangle" if shape == "mesh" else shape]), *ray)
    assert (hits.shape[0], hits.primitive[0], hits.visibility[0, 0]) == (0, 0, 1)
    assert hits.t[0] == pytest.approx(true.t, rel=2.0**-50)
    assert np.abs(hits.position[0, :2] - [0.25, 0.125]).max() <= 2.0**-50
    assert np.abs(hits.normal[0] - true.normal).max() <= 2.0**-48


@pytest.mark.parametrize(
    ("name", "row", "value"),
    [
        ("origins", 1, [0, -1.01 * MAX_ORIGIN, 0]),
        ("directions", 0, [0, 0.99 * SHORTEST, 1e-320]),
        ("directions", 2, [0, 0, -1.01 * LONGEST]),
    ],
)
def test_rays_whose_t_no_number_holds_are_refused(name: str, row: int, value: list[float]) -> None:
    rays: dict[str, Any] = {"origins": [[0.0, 0, 5]] * 3, "directions": [[0.0, 0, -1]] * 3}
    rays[name][row] = value
    with pytest.raises(ValueError, match=rf"component in row {row} of '{name}' must be between"):
        traced([SHAPES["triangle"]], **rays)


@BOTH
def test_light_point_in_a_tiny_ball_is_hidden(quality: Any) -> None:
    """A radius of 1e-25: in its frame the squares of the lamp's edges are beyond float32."""
    floor = rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0])
    light = lamp([-2, 4, -2], [4, 0, 0], [0, 0, 4])
    shapes = [floor, sphere([1, 4, 1], 1e-25)]
    hits = traced(shapes, [[0.3, 2, 0.7]], [[0, -1, 0]], lights=[light], points=4, quality=quality)
    assert hits.visibility[0, 0] == 0.75
