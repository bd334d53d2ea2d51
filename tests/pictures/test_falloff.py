"""Light that falls with the distance, against form factors and the inverse square."""

import math

import numpy as np
import pytest

from tests.documents import camera, lamp, phong, rectangle, sampled, scene
from tests.pictures.parts import DOUBLE, SINGLE, image_of

MATT = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}
ONE_PIXEL = {"width": 1, "height": 1, "vertical_fov": 1e-3}
PRECISIONS = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])


def parallel_form_factor(a: float, b: float, c: float) -> float:
    """Howell C-11: a patch under the corner of an a x b rectangle at height c, parallel to it."""
    x, y = a / c, b / c
    return (
        x / math.hypot(1, x) * math.atan(y / math.hypot(1, x))
        + y / math.hypot(1, y) * math.atan(x / math.hypot(1, y))
    ) / (2 * math.pi)


def perpendicular_form_factor(a: float, b: float, c: float) -> float:
    """Howell C-12: a patch at distance c that looks along a rectangle's foot: width b, height a."""
    x, y = a / b, c / b
    return (math.atan(1 / y) - y / math.hypot(x, y) * math.atan(1 / math.hypot(x, y))) / (2 * math.pi)


def floor_seen_at_the_origin(*lights: object, points: int = 4096, **changes: object) -> dict:
    view = camera(position=[0.3, 0.4, -2], look_at=[0, 0, 0], **ONE_PIXEL)
    floor = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
    settings = {"camera": view, "materials": MATT, "ambient": [0, 0, 0], **changes}
    return scene(floor, lights=lights, sampling=sampled(pattern="center", points=points), **settings)


def physical(*args: object, **changes: object) -> dict:
    return lamp(*args, color=(1, 1, 1), falloff="physical", visible=False, **changes)  # type: ignore[arg-type]


def seen(document: dict, quality: object = DOUBLE) -> float:
    pixel = image_of(document, quality)[0, 0]  # type: ignore[arg-type]
    assert pixel[0] == pixel[1] == pixel[2]
    return float(pixel[0])


@PRECISIONS
@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (0.5, 3, 4)])
def test_parallel_lamp_form_factor(a: float, b: float, c: float, quality: object) -> None:
    lit = seen(floor_seen_at_the_origin(physical([0, c, 0], [a, 0, 0], [0, 0, b])), quality)
    # The midpoint rule on 64 x 64 cells errs by some (cell / distance)^2 / 24 of the value, twice.
    assert lit == pytest.approx(parallel_form_factor(a, b, c), rel=(max(a, b) / 64 / c) ** 2)


@PRECISIONS
@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (2, 1, 0.7)])
def test_perpendicular_lamp_form_factor(a: float, b: float, c: float, quality: object) -> None:
    lit = seen(floor_seen_at_the_origin(physical([0, 0, c], [b, 0, 0], [0, a, 0])), quality)
    assert lit == pytest.approx(perpendicular_form_factor(a, b, c), rel=(max(a, b) / 64 / c) ** 2)


@PRECISIONS
@pytest.mark.parametrize("distance", [1e-6, 3, 1e6])
def test_point_light_falls_with_the_square(distance: float, quality: object) -> None:
    light = {"type": "point", "position": [0, distance, 0], "color": [1, 1, 1], "falloff": "physical"}
    view = camera(position=[0, 0.5, -2], look_at=[0, 0, 0], **ONE_PIXEL)
    lit = seen(floor_seen_at_the_origin(light, camera=view), quality)
    # The camera ray hits the floor within rounding of the origin, which matters at a millionth.
    assert lit == pytest.approx(distance**-2, rel=1e-6)


@PRECISIONS
@pytest.mark.parametrize("distance", [0.0, 1e-20])
def test_lamp_that_touches_the_floor(distance: float, quality: object) -> None:
    lights = [
        {"type": "point", "position": [0, distance, 0], "color": [1, 1, 1], "falloff": "physical"},
        physical([0, distance, 0], [1, 0, 0], [0, 1, 0]),
        physical([-1, distance, -1], [2, 0, 0], [0, 0, 2]),
    ]
    view = camera(position=[0, 0.5, -2], look_at=[0, 0, 0], width=9, height=9, vertical_fov=20)
    for points in (1, 9, 64):
        image = image_of(floor_seen_at_the_origin(*lights, camera=view, points=points), quality)  # type: ignore[arg-type]
        assert np.isfinite(image).all()
