"""Lights: what the camera sees of them, and where their points are."""

from typing import Any

import numpy as np
import pytest

from accuracy.hard_cases.documents import Json, bulb, lamp, phong, rectangle, sampled, scene, sun
from renderer.lights import emitters
from schemas.lights import DirectionalLight, ParallelogramLight
from schemas.quality import LightSampling
from tests.numerics.tracing import EPS, traced
from tests.pictures.parts import DOUBLE, SINGLE, image_of

VIEW = {"position": [0, 0, 5], "look_at": [0, 0, 0], "width": 3, "height": 3, "vertical_fov": 20}
WALL = rectangle([-4, -4, 0], [8, 0, 0], [0, 8, 0])
COLOR = [0.25, 0.5, 0.75]
BLACK = [0.0, 0.0, 0.0]


def middle(*shapes: Json, lights: Any, **changes: Any) -> list[float]:
    """The colour in the middle of the picture."""
    document = scene(*shapes, lights=lights, camera=VIEW, materials={"plain": phong()}, **changes)
    return [float(x) for x in image_of(document)[1, 1]]


def screen(z: float, **changes: Any) -> Json:
    return lamp([-1, -1, z], [2, 0, 0], [0, 2, 0], COLOR, **changes)


def test_visible_lamp() -> None:
    for edges in (([2, 0, 0], [0, 2, 0]), ([0, 2, 0], [2, 0, 0])):
        for sides in (True, False):
            assert middle(WALL, lights=[lamp([-1, -1, 2], *edges, COLOR, two_sided=sides)]) == COLOR


def test_lamp_in_a_wall() -> None:
    assert middle(WALL, lights=[screen(0)]) == COLOR


def test_invisible_lamp() -> None:
    away = middle(WALL, lights=[screen(2, visible=False)])
    assert away not in (COLOR, BLACK)


def test_black_lamp_hides() -> None:
    assert middle(WALL, lights=[lamp([-1, -1, 2], [2, 0, 0], [0, 2, 0], BLACK)]) == BLACK


def test_lamp_casts_no_shadow() -> None:
    lit = middle(WALL, lights=[sun([0, 0, -1])])
    assert middle(WALL, lights=[sun([0, 0, -1]), screen(7, visible=False)])[0] > lit[0]
    before = traced([WALL], [[0, 0, 3]], [[0, 0, -1]], lights=[bulb([0, 0, 9]), screen(5)])
    assert before.visibility.tolist() == [[1, 1]]


@pytest.mark.parametrize("samples", [1, 4, 9, 64])
def test_uniform_light_points(samples: int) -> None:
    light = ParallelogramLight.model_validate(lamp([1, 2, 3], [2, 0, 1], [0, 3, 1]))
    emitter = emitters.build_rectangle(0, light, LightSampling(pattern="uniform", samples=samples), 0)
    n = round(samples**0.5)
    expected = {
        (1 + 2 * u, 2 + 3 * v, 3 + u + v) for u in (np.arange(n) + 0.5) / n for v in (np.arange(n) + 0.5) / n
    }
    found = emitter.shared_points().T
    assert len(found) == samples
    for place in expected:
        assert np.abs(found - place).max(axis=1).min() <= 16 * EPS


@pytest.mark.parametrize("length", [1e-300, 1e-30, 3.0, 1e14])
def test_length_of_a_direction(length: float) -> None:
    light = DirectionalLight.model_validate(sun([0.3 * length, -0.4 * length, 1.2 * length]))
    emitter = emitters.build_directional(0, light, LightSampling(), 0)
    assert np.abs(emitter.centre.ravel() - np.array([-3, 4, -12]) / 13).max() <= 4 * EPS


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("light", ["uniform", "random", "stratified", "sobol"])
def test_tiny_lamp_equals_a_point_light(light: str, quality: Any) -> None:
    document = scene(WALL, camera=VIEW, lights=[bulb([1, 1, 3])], sampling=sampled(1, 16, light=light))
    speck = document | {
        "lights": [lamp([1, 1, 3], [1e-9, 0, 0], [0, 1e-9, 0], [0.5, 0.6, 0.7], visible=False)]
    }
    assert np.abs(image_of(speck, quality) - image_of(document, quality)).max() <= 4 * 2.0**-23


def test_points_of_two_lights_differ() -> None:
    """Two equal lamps of random points average two sets, not one set twice."""
    light = screen(3, visible=False)
    sampling = sampled(1, 4, light="random")
    once = image_of(scene(WALL, camera=VIEW, lights=[light], ambient=BLACK, sampling=sampling))
    twice = image_of(scene(WALL, camera=VIEW, lights=[light, light], ambient=BLACK, sampling=sampling))
    assert np.abs(twice - 2 * once).max() > 1e-3
