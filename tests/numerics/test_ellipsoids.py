"""Ellipsoids: far, flat, giant, touched and entered ones against roots of 200 binary digits; normals, uv."""

import itertools
import math
import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from renderer.math.arrays import unit
from tests.documents import Json, ellipsoid, scene, sphere
from tests.numerics import families, oracle
from tests.numerics.families import Drawn, Ray, aimed, between, direction, family, listed
from tests.numerics.judging import (
    assert_right,
    of_the_axes,
    relative,
    round_details,
    rounded,
    semi_axes,
)
from tests.numerics.oracle import Answer
from tests.numerics.tracing import EPS, mp, problems, read_shape, traced

Floats = np.ndarray
RADIUS = 25.0
ON_SPHERE = [(7, 24, 0), (15, 20, 0), (9, 12, 20), (12, 15, 16), (25, 0, 0)]
"""Whole numbers whose squares add up to that of the radius."""


def placed_exactly(chosen: random.Random) -> tuple[Json, Floats, Floats]:
    """An ellipsoid, a place exactly on it, and a vector along the normal there; all whole numbers.

    The frame has rows of one length by Euler's parametrisation of rotations.
    """
    a, b, c, d = (chosen.randint(low, 3) for low in (-3, -3, -3, 1))
    rows = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
    place = np.array(chosen.sample(chosen.choice(ON_SPHERE), 3)) * [chosen.choice([-1, 1]) for _ in range(3)]
    middle = np.array([chosen.randint(-50, 50) for _ in range(3)])
    powers = 2.0 ** np.array([chosen.randint(-3, 3) for _ in range(3)])
    shape = ellipsoid(middle, *(RADIUS * powers[:, None] * rows))
    return shape, middle + (place * powers) @ rows, (place / powers) @ rows


def in_tangent_planes(chosen: random.Random) -> Drawn:
    """Rays in tangent planes through the place where these touch, from up to some million radii away."""
    shape, place, normal = placed_exactly(chosen)

    def ray() -> Ray:
        along = np.cross(normal, [chosen.randint(-9, 9) for _ in range(3)])
        along = along if along.any() else np.cross(normal, normal[[1, 2, 0]])
        return listed(place - 2.0 ** chosen.randint(0, 16) * along), listed(along)

    return shape, ray


def touching(shape: Any, _true: Answer, origin: Floats, along: Floats) -> float:
    """Half the chord of a line that passes inside by 16 roundings."""
    axes = semi_axes(shape)
    rows = axes / (axes * axes).sum(axis=1)[:, None]
    away, length = (math.hypot(*(rows @ v)) for v in (origin - np.array(shape.center), along))
    return math.sqrt(16 * EPS * away) / length


def from_the_surface(chosen: random.Random) -> Drawn:
    shape, place, _ = placed_exactly(chosen)
    return shape, lambda: (listed(place), direction(chosen))


NEAR_ONE, FAR_APART = families.axes_near_one, families.axes_far_apart
FAMILIES: dict[str, tuple[Any, ...]] = {
    "tiny and far": (lambda: family("far and tiny", families.far_and_tiny), relative, round_details),
    "ground": (lambda: family("ground", families.ground), of_the_axes(4), round_details),
    "near the surface": (
        lambda: family("close", families.near_the_surface),
        of_the_axes(16),
        round_details,
    ),
    "thin and far": (
        lambda: aimed("thin and far", FAR_APART, distance=between(6, 12)),
        relative,
        round_details,
    ),
    "far centre": (lambda: aimed("far away", NEAR_ONE, center=between(2, 12)), relative, round_details),
    "nearly tangent": (lambda: family("tangent", families.nearly_tangent), relative, round_details),
    "exactly tangent": (lambda: family("exactly tangent", in_tangent_planes), touching, None),
    "from the surface": (lambda: family("from the surface", from_the_surface), rounded, round_details),
    "flat, from outside": (lambda: family("flat", families.flat_from_outside), rounded, round_details),
    "directions of any length": (
        lambda: aimed("lengths", NEAR_ONE, length=between(-198, 198)),
        rounded,
        round_details,
    ),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_ellipsoid_is_hit_as_exact_numbers_say(name: str) -> None:
    rays, allowed, details = FAMILIES[name]
    assert_right(rays(), details, allowed)


SINES = [1e-1, 1e-5, 1e-9, 1e-15, 0.0]
"""Of polar angles."""
BESIDE = [0.0, 1e-20, 2.0**-53, 1e-9]
"""Sines of longitudes on both sides of the seam."""


def around() -> Iterator[tuple[float, float]]:
    """Unit vectors to all sides, to rounding, and on both sides of the seam."""
    for turn in np.arange(12) * np.pi / 6 + 0.1:
        yield math.cos(turn), math.sin(turn)
    for x, y, sign in itertools.product((-1.0, 1.0), BESIDE, (-1.0, 1.0)):
        yield x, sign * y


def coordinates(x: float, y: float, side: int) -> tuple[float, float]:
    """Texture coordinates of the place on a unit sphere at (x, y), above or below, rounded once."""
    u = mp.atan2(y, x) / (2 * mp.pi) if x or y else mp.mpf(0)
    v = mp.asin(mp.hypot(x, y)) / mp.pi
    return float(u + 1 if u < 0 else u), float(v if side < 0 else 1 - v)


@pytest.mark.parametrize("side", [-1, 1], ids=["lower pole", "upper pole"])
@pytest.mark.parametrize("turn", range(3), ids=["about z", "about x", "about y"])
def test_texture_coordinates_at_a_pole(turn: int, side: int) -> None:
    """4 eps, also at a sine of 1e-15; all axes are powers of two, and the ends of u are one place."""
    semi = np.array([1.0, 2.0, 0.5])
    where = np.array([(sine * x, sine * y) for sine in SINES for x, y in around()])
    starts = np.roll(np.column_stack((where * semi[:2], np.full(len(where), 3.0 * side))), turn, axis=1)
    ways = np.roll(np.broadcast_to([0.0, 0.0, -side], starts.shape), turn, axis=1)
    uv = traced([ellipsoid([0, 0, 0], *np.roll(np.diag(semi), turn, axis=1))], starts, ways).uv
    true = np.array([coordinates(x, y, side) for x, y in where.tolist()])
    off = np.abs(uv - true)
    off[:, 0] = np.minimum(off[:, 0], 1 - off[:, 0])
    assert (off <= 4 * EPS * true).all()
    assert ((uv[:, 0] >= 0) & (uv[:, 0] < 1)).all()


@pytest.mark.parametrize("i", range(3))
def test_semi_axis_that_is_none_is_refused(i: int) -> None:
    axes = np.eye(3)
    for size in (0.0, 1e-320, 1e-200):
        assert problems(scene(with_axis(i, size * axes[i]))) == [f"/shapes/0/axes/{i}"]
    for size in (1.01e15, math.nan, math.inf):
        axis = np.where(axes[i] > 0, size, 0.0)
        assert problems(scene(with_axis(i, axis))) == [f"/shapes/0/axes/{i}/{i}"]
    assert problems(scene(with_axis(i, axes[i] + 2e-6 * axes[i - 1]))) == ["/shapes/0/axes"]


@pytest.mark.parametrize("size", [-1.0, 1e-8, 1e8, 1e-100])
def test_rare_semi_axis_is_hit_from_its_centre(size: float) -> None:
    way = unit(np.array([[0.3], [-0.4], [0.5]]))[:, 0]
    for shape in (with_axis(1, np.array([0, size, 0])), sphere([0, 0, 0], abs(size))):
        true = oracle.answer(read_shape(shape), [0, 0, 0], way).t
        assert abs(traced([shape], [[0.0, 0, 0]], [way]).t[0] - true) <= 1e-10 * true


def with_axis(number: int, axis: Floats) -> Json:
    """A unit sphere with another vector in place of one of its semi-axes."""
    axes = np.eye(3)
    axes[number] = axis
    return ellipsoid([0, 0, 0], *axes)
