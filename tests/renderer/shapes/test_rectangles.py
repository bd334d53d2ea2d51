"""Rectangles in both forms."""

import numpy as np
import pytest

from renderer.math.arrays import column
from renderer.shapes.rectangles import edges_of
from tests.documents import rectangle
from tests.numerics.tracing import EPS, traced


@pytest.mark.parametrize(("u", "v"), [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.5, 0.5)])
def test_texture_coordinates_grow_along_the_tangents(u: float, v: float) -> None:
    """The tangent is made perpendicular; (0, 0) is at the corner against both."""
    form = {
        "type": "rectangle",
        "center": [1, 2, 3],
        "normal": [0, 0, 5],
        "tangent": [2, 0, 7],
        "size": [4, 2],
    }
    place = [1 + 4 * (u - 0.5), 2 + 2 * (v - 0.5), 9]
    hits = traced([form | {"material": "plain"}], [place], [[0, 0, -1]])
    assert np.abs(hits.uv[0] - [u, v]).max() <= 4 * EPS
    assert hits.normal[0].tolist() == [0, 0, 1]


@pytest.mark.parametrize("angle", [1e-8, 1e-4, 1.0])
def test_edges_are_perpendicular_for_any_tangent(angle: float) -> None:
    normal, center = column((0.3, -0.5, 0.8)), column((1.0, 2.0, 3.0))
    tangent = normal + angle * column((0.7, 0.1, -0.2))
    corner, first, second = edges_of(center, normal, tangent, (3.0, 0.5))
    unit = normal / np.linalg.norm(normal)
    for edge, length in ((first, 3.0), (second, 0.5)):
        assert abs(np.linalg.norm(edge) - length) <= 8 * EPS * length
        assert abs((edge * unit).sum()) <= 8 * EPS * length
    assert abs((first * second).sum()) <= 8 * EPS * 1.5
    assert np.abs(corner + first / 2 + second / 2 - center).max() <= 8 * EPS * 3
    assert np.cross(first.ravel(), second.ravel()) @ unit.ravel() > 0


@pytest.mark.parametrize("u", [0, 1])
@pytest.mark.parametrize("v", [0, 1])
def test_parallelogram_corners_are_where_it_says(u: int, v: int) -> None:
    corner, first, second = np.array([1, 2, 3]), np.array([2, 0, 1]), np.array([1, 3, 0])
    ends = np.array([u, v])
    inside = 1e-9 * (1 - 2 * ends)
    places = [corner + w[0] * first + w[1] * second + [0, 0, 5] for w in (ends + inside, ends - inside)]
    hits = traced([rectangle(corner, first, second)], np.array(places), [[0, 0, -1]] * 2)
    assert hits.shape.tolist() == [0, -1]
    assert np.abs(hits.uv[0] - [u, v]).max() <= 1.1e-9
