"""Ellipsoids: hits, normals and texture coordinates."""

import numpy as np
import pytest

from schemas.reading import read_scene
from tests.documents import Json, bulb, camera, ellipsoid, phong, rectangle, scene, sphere, sun
from tests.numerics import oracle
from tests.numerics.tracing import EPS, traced
from tests.pictures.parts import image_of

AXES = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1e-6]]


@pytest.mark.parametrize("distance", [3.0, 1e6, 1e9, 1e12])
def test_thin_ellipsoid_is_hit_from_any_distance(distance: float) -> None:
    """In radii of the unit sphere the longest of these rays is 1e18 long, and its rounding many radii."""
    document = ellipsoid([0, 0, 0], *AXES)
    shape = read_scene(scene(document))[0].shapes[0]
    rng = np.random.default_rng(5)
    targets = np.column_stack((rng.uniform(-0.6, 0.6, (200, 2)), np.zeros(200)))
    origins = targets + distance * np.column_stack((rng.uniform(-0.5, 0.5, (200, 2)), np.ones(200)))
    directions = targets - origins
    hits = traced([document], origins, directions, lights=[sun([0, 0, -1])])
    assert (hits.shape == 0).all()
    assert (hits.visibility == 1).all()
    for origin, direction, place, uv in zip(origins, directions, hits.position, hits.uv, strict=True):
        true = oracle.answer(shape, origin, direction)
        cosine = -np.dot(true.normal, direction) / np.linalg.norm(direction)
        assert np.linalg.norm(place - np.array(true.position)) <= 8 * EPS * distance / cosine
        assert (uv[1] > 0.5) == (true.uv[1] > 0.5)


def test_sphere_is_the_ellipsoid_with_equal_axes() -> None:
    origins = np.random.default_rng(2).normal(size=(100, 3)) * 6
    other = ellipsoid([0.1, 0.2, 0.3], [1.5, 0, 0], [0, 1.5, 0], [0, 0, 1.5])
    a, b = (traced([shape], origins, -origins) for shape in (sphere([0.1, 0.2, 0.3], 1.5), other))
    for name in ("t", "position", "normal", "uv", "shape"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()


def test_axes_in_another_order_turn_the_texture_alone() -> None:
    axes = [[1.0, 0, 0], [0, 2.0, 0], [0, 0, 0.5]]
    origins = np.random.default_rng(3).normal(size=(100, 3)) * 6
    a, b = (traced([ellipsoid([0, 0, 0], *x)], origins, -origins) for x in (axes, axes[1:] + axes[:1]))
    assert np.abs(a.t / b.t - 1).max() <= 16 * EPS
    assert np.abs(a.normal - b.normal).max() <= 64 * EPS
    assert not np.allclose(a.uv, b.uv)


@pytest.mark.parametrize("away", [0.0, 3e3, 3e6])
def test_sphere_in_the_place_of_a_mirror_changes_nothing(away: float) -> None:
    """Of equal distances the first shape wins, and what leaves it leaves the other one too."""
    place = [away, 1.5, -away]
    shiny = {**sphere(place, 1.0), "material": "shiny"}
    floor = rectangle([away - 6, 0, -away - 6], [0, 0, 12], [12, 0, 0])
    view = camera(position=[away + 1, 3, 5 - away], look_at=place, width=24, height=24)
    common: Json = {
        "camera": view,
        "lights": [bulb([away - 2, 6, 3 - away])],
        "materials": {"plain": phong(), "shiny": phong(mirror=0.9, max_depth=3)},
    }
    alone, twice = scene(shiny, floor, **common), scene(shiny, floor, sphere(place, 1.0), **common)
    assert np.array_equal(image_of(twice), image_of(alone))
