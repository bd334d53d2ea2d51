"""Spot lights: points of light with a cone around them, against the formula of glTF."""

import math
from typing import Any

import mpmath
import numpy as np
import pytest

import renderer
from schemas.quality import Quality, TargetQuality
from tests.documents import Json, bulb, camera, phong, rectangle, sampled, scene, sphere, spot
from tests.pictures.parts import DOUBLE, SINGLE, image_of, plan_of

FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
MATT = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}


def one_pixel(light: Json) -> Json:
    """The floor at the origin."""
    view = camera(position=[0.3, 0.4, -2], look_at=[0, 0, 0], width=1, height=1, vertical_fov=1e-3)
    sampling = sampled(pattern="center")
    return scene(FLOOR, lights=[light], camera=view, materials=MATT, ambient=[0, 0, 0], sampling=sampling)


def attenuation(angle: float, inner: float, outer: float) -> float:
    """Angular attenuation of KHR_lights_punctual, with digits to spare; angles in degrees."""
    with mpmath.workdps(60):
        seen, begin, end = (mpmath.cos(mpmath.radians(mpmath.mpf(x))) for x in (angle, inner, outer))
        return float(min(max((seen - end) / (begin - end), 0), 1) ** 2)


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("length", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize(
    ("angle", "inner", "outer"),
    [
        (0, 0, 45),
        (30, 0, 45),
        (44.9, 10, 45),
        (45.1, 10, 45),
        (20, 25, 60),
        (89.5, 1, 90),
        (7e-4, 5e-4, 1e-3),
        (20.0000005, 20, 20.000001),
    ],
)
def test_edge_is_that_of_gltf(
    angle: float, inner: float, outer: float, length: float, quality: Quality
) -> None:
    """The light is straight above; the floor is `angle` away from the middle of the cone."""
    turned = math.radians(angle)
    axis = [length * math.sin(turned), -length * math.cos(turned), 0.0]
    lit = image_of(one_pixel(spot([0, 2, 0], axis, [1, 1, 1], inner_angle=inner, outer_angle=outer)), quality)
    # The ray hits the floor within 1e-15 of the origin, which is so much of the width of the edge.
    width = math.radians(outer - inner)
    assert lit[0, 0, 0] == pytest.approx(attenuation(angle, inner, outer), rel=2.0**-23 + 1e-14 / width)


def room(light: Json) -> Json:
    view = camera(position=[0, 3, 7], look_at=[0, 0.8, 0], width=24, height=18)
    materials = {"plain": phong(specular=0.4, shininess=30, mirror=0.3)}
    ball = sphere([0.3, 1, 0], 0.9)
    return scene(FLOOR, ball, lights=[light], camera=view, materials=materials, sampling=sampled(4))


@pytest.mark.parametrize("falloff", ["none", "physical"])
@pytest.mark.parametrize(
    "quality",
    [SINGLE, DOUBLE, TargetQuality(mode="target", error=2 / 255)],
    ids=["single", "double", "target"],
)
def test_cone_around_everything_is_a_point_light(quality: Quality, falloff: str) -> None:
    above = [0.5, 60, 2]
    cone = {"outer_angle": 60, "inner_angle": 59, "falloff": falloff}
    color = [2000.0, 1500.0, 1000.0] if falloff == "physical" else [0.9, 0.8, 0.7]
    plain = plan_of(room(bulb(above, color) | {"falloff": falloff}), quality)
    inside = plan_of(room(spot(above, [0, -1, 0], color, **cone)), quality)
    one, other = renderer.render(plain), renderer.render(inside)
    assert one.image.tobytes() == other.image.tobytes()
    assert one.report["rays"] == other.report["rays"]


def test_nothing_is_asked_outside_the_cone() -> None:
    """No shadow rays, no visibility; a cone that shines away from every shape is left out."""
    above: Any = [0, 4, 0]
    plan = plan_of(room(spot(above, [0, -1, 0], outer_angle=10)))
    whole = plan_of(room(bulb(above)))
    rays, most = (renderer.render(each).report["rays"]["shadow"] for each in (plan, whole))
    assert 0 < rays < most / 4
    down = [[0.0, -1, 0]] * 3
    hits = renderer.trace(plan, [[5.0, 2, 0], [0.0, 3, 0], [-5.0, 2, 0]], down)
    assert hits.visibility[:, 0].tolist() == [0, 1, 0]
    away = plan_of(room(spot(above, [0, 1, 0])))
    assert [item.effect for item in away.left_out] == ["lights.spot"]
    dark = renderer.render(plan_of(room(bulb(above, [0, 0, 0])))).image
    assert np.array_equal(renderer.render(away).image, dark)
