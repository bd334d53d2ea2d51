"""Numbers that a scene may hold, and those that it must not; the rare ones are drawn."""

import warnings
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.math.arrays import unit
from tests.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    scene,
    sphere,
    triangle,
)
from tests.numerics.tracing import EPS, mp, problems, traced

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("shape", "place"),
    [
        (mesh(CORNERS, [[0, 1, 2]], rotate={"axis": [0.0, -0.0, 0.0], "degrees": 30}), "rotate/axis"),
        (triangle(*CORNERS, normals=[[0, 0, 1], [0, 0, 0], [0, 0, 1]]), "normals/1"),
    ],
    ids=["axis", "normal"],
)
def test_vector_of_length_zero_is_refused_where_it_stands(shape: Json, place: str) -> None:
    assert problems(scene(shape)) == [f"/shapes/0/{place}"]


def wall(size: float, distance: float) -> Json:
    """A square before a ray from the origin along z."""
    return rectangle([-size / 2, -size / 2, distance], [size, 0, 0], [0, size, 0])


@pytest.mark.parametrize("size", [1e308, -1e308, 1e200, 1.01e15, 5e-324, 1e-320, 1e-200, 0.99e-100])
def test_wall_of_no_usable_size_is_refused(size: float) -> None:
    assert {found[:9] for found in problems(scene(wall(size, abs(size))))} == {"/shapes/0"}


def test_wall_of_any_usable_size_is_hit_where_it_is() -> None:
    """From 1e-100 to 1e15, as far away as it is large; and two planes of whole numbers beyond float32."""
    for size in (10.0**k for k in (*range(-100, 0, 10), *range(16))):
        t = traced([wall(size, size)], [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]).t[0]
        assert abs(t - size) <= 4 * EPS * size
    assert traced([wall(16.0, 16777217.0)], [[0.0, 0.0, 16777216.0]], [[0.0, 0.0, 1.0]]).t[0] == 1


def test_unit_vector_of_a_denormal_one_is_exact() -> None:
    """Lengths from 1e-323 to 1, to 50 digits."""
    vectors = np.random.default_rng(1).normal(size=(3, 300)) * 10.0 ** -np.linspace(0, 323, 300)
    vectors = vectors[:, (vectors != 0).any(axis=0)]
    for vector, found in zip(vectors.T.tolist(), unit(vectors).T.tolist(), strict=True):
        parts = [mp.mpf(x) for x in vector]
        assert max(abs(a / mp.norm(parts) - b) for a, b in zip(parts, found, strict=True)) <= 4 * EPS


FLOOR = rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])


def shown(*shapes: Json, **changes: Any) -> Json:
    """Shapes on a floor under a lamp; without shapes the floor alone."""
    return scene(*shapes, FLOOR, **{"lights": [lamp([0, 5, 0], [1, 0, 0], [0, 0, 1])], **changes})


def seen(**changes: Any) -> Json:
    return shown(camera=camera(**changes))


def painted(**changes: Any) -> Json:
    return shown(materials={"plain": phong(**changes)})


def disc(height: float) -> Json:
    return shown(ellipsoid([0, 1, 0], [1, 0, 0], [0, height, 0], [0, 0, 1]))


@pytest.mark.parametrize(
    "changes",
    [{"shininess": -1}, {"transmission": 1, "ior": 0}, {"mirror": 1.5}, {"mirror": 1, "max_depth": 65}],
)
def test_material_out_of_range_is_refused_where_it_stands(changes: Json) -> None:
    assert problems(painted(**changes)) == [f"/materials/plain/{[*changes][-1]}"]


ACCEPTED: dict[str, tuple[Json, list[str]]] = {
    "up along the view": (seen(position=[0, 5, 0], look_at=[0, 0, 0]), ["up_parallel_to_view"]),
    "view of 179.99 degrees": (seen(vertical_fov=179.99), []),
    "one pixel": (seen(width=1, height=1, look_at=[0.1, 0, 0]), []),
    "triangle on a line": (shown(triangle([0, 0, 0], [1, 1, 1], [3, 3, 3])), ["no_area"]),
    "triangle of 1e-15": (shown(triangle([0, 0, 0], [1e-15, 0, 0], [0, 1e-15, 0])), []),
    "triangle of 1e15": (shown(triangle([-1e15, 0, -9], [1e15, 0, -9], [0, 1e15, -9])), ["very_large"]),
    "ball of a million as ground": (shown(sphere([0, -1e6, 0], 1e6)), []),
    "ball of 1e-100": (shown(sphere([0, 1, 0], 1e-100)), []),
    "disc of 1 to 1e-6": (disc(1e-6), []),
    "disc of 1 to 1e-9": (disc(1e-9), ["very_flat"]),
    "coordinate 1e15": (shown(sphere([0, 0, -1e15], 9e14)), []),
    "light in the floor": (shown(lights=[lamp([0, 0, 0], [1, 0, 0], [0, 0, 1])]), []),
    "light that stands on the floor": (shown(lights=[lamp([0, 0, 0], [1, 0, 0], [0, 1, 0])]), []),
    "light in a ball": (shown(sphere([0, 1, 0], 1), lights=[bulb([0, 1, 0])]), ["light_inside"]),
    "light of radiance 1e30": (shown(lights=[bulb([0, 5, 0], [1e30, 1e30, 1e30])]), []),
    "shininess 1e7": (painted(specular=0.5, shininess=1e7), []),
    "huge uv": (shown(triangle(*CORNERS, uvs=[[1e9, -1e9], [1e9 + 1, 0], [0, 1e9]])), []),
}


@pytest.mark.parametrize(("document", "codes"), ACCEPTED.values(), ids=ACCEPTED)
def test_rare_value_is_drawn_with_its_warning_alone(document: Json, codes: list[str]) -> None:
    loaded = renderer.load_scene(document)
    assert [problem.code for problem in loaded.warnings] == codes
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = renderer.render(renderer.compile_scene(loaded))
    assert np.isfinite(result.image).all()
    assert result.report["numerics"]["non_finite"] == 0
