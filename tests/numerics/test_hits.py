"""Hits where no number decides: rays that are none, ties, the side of a normal, many rays at once."""

import math

import numpy as np
import pytest

from tests.documents import ellipsoid, rectangle, sphere, triangle
from tests.numerics.tracing import traced

SHAPES = {
    "triangle": triangle([-1.1, -0.3, 0.2], [2.3, -0.7, 0.1], [0.4, 2.9, -0.6]),
    "rectangle": rectangle([-1.1, -0.9, 0.2], [2.3, 0.1, 0.1], [0.4, 2.1, -0.6]),
    "ellipsoid": ellipsoid([0.1, 0.2, 0.3], [1.1, 0, 0], [0, 0.7, 0], [0, 0, 1.9]),
}


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
