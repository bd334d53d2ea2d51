"""Lights: what the camera sees of them, and where their points are."""

from typing import Any

import numpy as np
import pytest

from renderer.lights import emitters
from schemas.lights import DirectionalLight, ParallelogramLight
from schemas.quality import LightSampling
from tests.documents import Json, bulb, lamp, phong, rectangle, sampled, scene, sun
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


def screen(z: float, color: list[float] = COLOR, **changes: Any) -> Json:
    return lamp([-1, -1, z], [2, 0, 0], [0, 2, 0], color, **changes)


@pytest.mark.parametrize(
    ("lights", "seen"),
    [
        ([screen(2)], COLOR),
        ([screen(2, two_sided=False)], COLOR),
        ([lamp([-1, -1, 2], [0, 2, 0], [2, 0, 0], COLOR, two_sided=False)], COLOR),
        ([screen(0)], COLOR),
        ([screen(2), screen(1, [1, 1, 0])], COLOR),
        ([screen(1, [1, 1, 0]), screen(2)], COLOR),
        ([screen(2, BLACK)], BLACK),
        ([screen(-1)], None),
        ([screen(9)], None),
        ([screen(2, visible=False)], None),
        ([bulb([0, 0, 1]), sun([0, 0, 1])], None),
    ],
    ids=["both sides", "front", "back", "in a wall", "nearer", "nearer last", "black", "behind the wall",
         "behind the camera", "invisible", "point and sun"],
)  # fmt: skip
def test_lamp_is_seen_as_its_flat_colour(lights: list[Json], seen: list[float] | None) -> None:
    found = middle(WALL, lights=lights)
    assert found == seen if seen is not None else found not in (COLOR, BLACK)


def test_lamp_casts_no_shadow() -> None:
    lit = middle(WALL, lights=[sun([0, 0, -1])])
    assert middle(WALL, lights=[sun([0, 0, -1]), screen(7, visible=False)])[0] > lit[0]
    before = traced([WALL], [[0, 0, 3]], [[0, 0, -1]], lights=[bulb([0, 0, 9]), screen(5)])
    assert before.visibility.tolist() == [[1, 1]]


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_lamp_points_are_cell_centres(n: int) -> None:
    light = ParallelogramLight.model_validate(lamp([1, 2, 3], [2, 0, 1], [0, 3, 1]))
    emitter = emitters.build_rectangle(0, light, LightSampling(pattern="uniform", samples=n * n), 0)
    steps = [(i + 0.5) / n for i in range(n)]
    expected = sorted((1 + 2 * u, 2 + 3 * v, 3 + u + v) for u in steps for v in steps)
    found = sorted(map(tuple, emitter.shared_points().T.tolist()))
    np.testing.assert_allclose(found, expected, rtol=0, atol=16 * EPS)


@pytest.mark.parametrize("length", [1e-300, 1e-30, 3.0, 1e14])
def test_sun_direction_may_have_any_length(length: float) -> None:
    light = DirectionalLight.model_validate(sun([0.3 * length, -0.4 * length, 1.2 * length]))
    emitter = emitters.build_directional(0, light, LightSampling(), 0)
    assert np.abs(emitter.centre.ravel() - np.array([-3, 4, -12]) / 13).max() <= 4 * EPS


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("light", ["uniform", "random", "stratified", "sobol"])
def test_lamp_of_no_size_lights_like_a_point(light: str, quality: Any) -> None:
    document = scene(WALL, camera=VIEW, lights=[bulb([1, 1, 3])], sampling=sampled(1, 16, light=light))
    speck = lamp([1, 1, 3], [1e-9, 0, 0], [0, 1e-9, 0], [0.5, 0.6, 0.7], visible=False)
    images = [image_of(each, quality) for each in (document, document | {"lights": [speck]})]
    assert np.abs(images[0] - images[1]).max() <= 4 * 2.0**-23


def test_lights_have_independent_points() -> None:
    """Two equal lamps of random points average two sets, not one set twice."""
    light = screen(3, visible=False)
    once, twice = (
        image_of(
            scene(WALL, camera=VIEW, lights=lights, ambient=BLACK, sampling=sampled(1, 4, light="random"))
        )
        for lights in ([light], [light, light])
    )
    assert np.abs(twice - 2 * once).max() > 1e-3
