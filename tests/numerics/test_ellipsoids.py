"""Ellipsoids: far, flat, giant, touched and entered ones against roots of 200 binary digits; normals, uv."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from renderer.math.arrays import unit
from tests.documents import Json, ellipsoid, scene, sphere
from tests.numerics import families, oracle
from tests.numerics.families import aimed, between, family
from tests.numerics.judging import assert_right, of_the_axes, relative, round_details, rounded
from tests.numerics.tracing import EPS, mp, problems, read_shape, traced

Floats = np.ndarray
NEAR_ONE, FAR_APART = families.axes_near_one, families.axes_far_apart
FAMILIES: dict[str, tuple[Any, ...]] = {
    "tiny and far": (lambda: family("far and tiny", families.far_and_tiny), relative, round_details),
    "ground": (lambda: family("ground", families.ground), of_the_axes(4), round_details),
    "near the surface": (lambda: family("close", families.near_the_surface), of_the_axes(16), round_details),
    "thin and far": (
        lambda: aimed("thin and far", FAR_APART, distance=between(6, 12)),
        relative,
        round_details,
    ),
    "far centre": (lambda: aimed("far away", NEAR_ONE, center=between(2, 12)), relative, round_details),
    "nearly tangent": (lambda: family("tangent", families.nearly_tangent), relative, round_details),
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
