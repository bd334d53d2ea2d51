"""Triangles: shared edges, normals, weights and tangent frames."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from renderer.math.arrays import unit
from renderer.shapes.frames import derivatives_of_texture, frame_of_texture
from renderer.shapes.triangles import unit_normals
from tests.documents import triangle
from tests.numerics.tracing import EPS, traced


def test_normal_turns_with_the_vertex_order() -> None:
    vertices = np.array([[0.1, 0.2, 0.3], [1.5, 0.1, -0.7], [-0.4, 1.9, 0.6]])
    normal = unit_normals(vertices[:, :, None])[:, 0]
    for order in itertools.permutations(range(3)):
        sign = np.linalg.det(np.eye(3)[list(order)])
        assert np.abs(unit_normals(vertices[list(order)][:, :, None])[:, 0] - sign * normal).max() <= 4 * EPS


def test_texture_coordinates_are_mixed_by_weight() -> None:
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


def test_tangent_points_where_the_texture_grows() -> None:
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
def test_tangent_needs_a_texture_with_area(texture: list[list[float]]) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)[:, :, None]
    *_, valid = frame_of_texture(
        vertices, np.array(texture, dtype=float)[:, :, None], np.array([[0], [0], [1.0]])
    )
    assert not valid.any()


@pytest.mark.parametrize("turned", [False, True])
def test_texture_derivatives_carry_edges_onto_edges(turned: bool) -> None:
    """Small whole numbers, and an area of the texture that is a power of two: all of it is exact."""
    vertices = np.array([[1, 2, 3], [4, 3, -1], [-2, 5, 1]], dtype=float)
    texture = np.array([[1, 1], [4, 2], [5, 5]], dtype=float)[:, :: -1 if turned else 1]
    by_u, by_v = derivatives_of_texture(vertices[:, :, None], texture[:, :, None])
    for corner in (1, 2):
        u, v = texture[corner] - texture[0]
        assert np.array_equal((by_u * u + by_v * v)[:, 0], vertices[corner] - vertices[0])


@pytest.mark.parametrize("exponent", [-1000, -600, 600, 1000])
def test_unit_vectors_do_not_depend_on_scale(exponent: int) -> None:
    """Squares of these lengths vanish or overflow; a power of two changes no digit of what is right."""
    vectors = np.random.default_rng(1).normal(size=(3, 100))
    assert np.array_equal(unit(vectors * 2.0**exponent), unit(vectors))
    assert np.abs((unit(vectors) ** 2).sum(axis=0) - 1).max() <= 8 * np.finfo(np.float64).eps


def test_shared_edge_is_hit_once() -> None:
    """A fan about one corner: no ray at a shared edge or corner falls through, and none hits both sides."""
    random = np.random.default_rng(8)
    angles = np.arange(6) + random.uniform(-0.2, 0.2, 6)
    middle = np.array([0.1, -0.2, 0.3])
    ring = middle + np.column_stack((3 * np.cos(angles), 2 * np.sin(angles), random.uniform(-0.2, 0.2, 6)))
    fan = [triangle(middle, ring[i], ring[i - 1]) for i in range(6)]
    shares = np.concatenate(([0.0], random.uniform(0, 0.9, 200)))[:, None]
    targets = np.concatenate([middle + share * (ring - middle) for share in shares])
    origins = targets + random.normal(size=targets.shape) * 0.3 + [0, 0, 5]
    hits = traced(fan, origins, targets - origins)
    assert (hits.shape >= 0).all()
    assert np.abs(hits.t - 1).max() <= 1e-12
    behind = traced(fan, targets + 1e-6 * (targets - origins), targets - origins)
    assert (behind.shape == -1).all()
