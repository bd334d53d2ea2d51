"""Triangles: normals, weights, and frames for normal maps."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from accuracy.hard_cases.documents import triangle
from renderer.shapes.frames import derivatives_of_texture, frame_of_texture
from renderer.shapes.triangles import unit_normals
from tests.numerics.tracing import EPS, traced


def test_normal_follows_vertex_order() -> None:
    vertices = np.array([[0.1, 0.2, 0.3], [1.5, 0.1, -0.7], [-0.4, 1.9, 0.6]])
    normal = unit_normals(vertices[:, :, None])[:, 0]
    for order in itertools.permutations(range(3)):
        sign = np.linalg.det(np.eye(3)[list(order)])
        assert np.abs(unit_normals(vertices[list(order)][:, :, None])[:, 0] - sign * normal).max() <= 4 * EPS


def test_texture_coordinates() -> None:
    uvs = [[0.25, -3], [2, 0.5], [-1, 7]]
    vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    for i, j in itertools.product(range(1, 4), range(1, 4)):
        if i + j < 4:
            hits = traced([triangle(*vertices, uvs=uvs)], [[i, j, 5]], [[0, 0, -1]])
            weights = (1 - Fraction(i + j, 4), Fraction(i, 4), Fraction(j, 4))
            expected = [
                float(sum(w * Fraction(uv[k]) for w, uv in zip(weights, uvs, strict=True))) for k in (0, 1)
            ]
            assert hits.uv[0].tolist() == expected


def test_frame_along_texture_coordinates() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        vertices, texture = rng.normal(size=(3, 3)), rng.normal(size=(3, 2))
        normal = unit_normals(vertices[:, :, None])
        tangent, handedness, valid = frame_of_texture(vertices[:, :, None], texture[:, :, None], normal)
        assert valid.all()
        first, second = vertices[1] - vertices[0], vertices[2] - vertices[0]
        solved = np.linalg.solve((texture[1:] - texture[0]), np.array([first, second]))
        assert np.dot(tangent[:, 0], solved[0]) == pytest.approx(np.linalg.norm(solved[0]), rel=1e-9)
        assert abs(np.dot(tangent[:, 0], normal[:, 0])) <= 8 * EPS
        assert np.dot(handedness * np.cross(normal[:, 0], tangent[:, 0]), solved[1]) > 0


@pytest.mark.parametrize(
    "texture", [[[0, 0], [0, 0], [0, 0]], [[0, 0], [1, 1], [2, 2]], [[0, 1], [0, 2], [0, 3]]]
)
def test_coordinates_without_area_have_no_tangent(texture: list[list[float]]) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)[:, :, None]
    *_, valid = frame_of_texture(
        vertices, np.array(texture, dtype=float)[:, :, None], np.array([[0], [0], [1.0]])
    )
    assert not valid.any()


@pytest.mark.parametrize("turned", [False, True])
def test_texture_derivatives(turned: bool) -> None:
    """Small whole numbers, and an area of the texture that is a power of two: all of it is exact."""
    vertices = np.array([[1, 2, 3], [4, 3, -1], [-2, 5, 1]], dtype=float)
    texture = np.array([[1, 1], [4, 2], [5, 5]], dtype=float)[:, :: -1 if turned else 1]
    by_u, by_v = derivatives_of_texture(vertices[:, :, None], texture[:, :, None])
    for corner in (1, 2):
        u, v = texture[corner] - texture[0]
        assert np.array_equal((by_u * u + by_v * v)[:, 0], vertices[corner] - vertices[0])
