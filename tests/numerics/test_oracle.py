"""Exact answers about triangles and rectangles, and the closed sphere that is made of triangles."""

import itertools

import numpy as np
import pytest

from accuracy.hard_cases import oracle, solids
from accuracy.hard_cases.documents import Json, rectangle, scene, triangle
from schemas.reading import read_scene

FLAT = [
    triangle([-16, 0, 8], [16, 0, 8], [0, 32, -24]),
    rectangle([-16, 0, 8], [32, 0, 0], [-8, 32, -24]),
]


@pytest.mark.parametrize("document", FLAT, ids=["triangle", "rectangle"])
def test_a_ray_exactly_through_the_border_hits_with_no_margin(document: Json) -> None:
    shape = read_scene(scene(document))[0].shapes[0]
    corners = corners_of(document)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for share, way in itertools.product((0, 0.25, 0.5, 1), ([3.0, -5, 7], [-1.0, 2, 64])):
            place = start + share * (end - start)
            answer = oracle.answer(shape, (place - way).tolist(), way)
            assert (answer.hit, answer.margin, answer.t) == (True, 0, 1)
            assert answer.position == tuple(place)


@pytest.mark.parametrize("document", FLAT, ids=["triangle", "rectangle"])
def test_a_ray_the_least_step_beside_the_border_misses(document: Json) -> None:
    """At the lower edge, along the third axis: places there have y = 0; the next double below is -5e-324."""
    shape = read_scene(scene(document))[0].shapes[0]
    for height, hit in ((0.0, True), (5e-324, True), (-5e-324, False)):
        assert oracle.answer(shape, [1.0, height, 50.0], [0.0, 0.0, -1.0]).hit == hit


def corners_of(document: Json) -> np.ndarray:
    if document["type"] == "triangle":
        return np.array(document["vertices"], dtype=float)
    corner, (first, second) = np.array(document["corner"]), np.array(document["edges"])
    return np.array([corner, corner + first, corner + first + second, corner + second], dtype=float)


def test_the_globe_is_closed_and_faces_outwards() -> None:
    """Each edge belongs to two triangles, once in each direction."""
    vertices, faces = solids.globe([0.0, 0.0, 0.0])
    assert faces.shape == (960, 3)
    edges = {(a, b) for face in faces.tolist() for a, b in zip(face, face[1:] + face[:1], strict=True)}
    assert len(edges) == 3 * 960
    assert edges == {(b, a) for a, b in edges}
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert ((np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) > 0).all()
