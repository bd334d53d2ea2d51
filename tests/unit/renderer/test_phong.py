"""Phong's model in closed form, at the ends of its numbers."""

from typing import Any

import mpmath
import numpy as np
import pytest

from accuracy.hard_cases.documents import Json, bulb, camera, phong, rectangle, scene, sun
from tests.images.parts import DOUBLE, SINGLE, image_of

BOTH = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
ONE = camera(position=[0, 4, 0], look_at=[0, 0, 0], up=[0, 0, -1], width=1, height=1)


def one_pixel(light: Json, quality: Any, view: Json = ONE, **material: Any) -> Any:
    """The colour of a floor in the middle of the picture, without ambient light."""
    document = scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
        camera=view,
        lights=[light],
        ambient=[0, 0, 0],
        materials={"plain": phong([0.5, 0.25, 1.0], ambient=0.0, **material)},
        sampling={"antialiasing": {"pattern": "center"}},
    )
    return image_of(document, quality)[0, 0]


@BOTH
@pytest.mark.parametrize("degrees", [0, 30, 60, 89])
def test_a_matt_surface_follows_the_cosine(degrees: float, quality: Any) -> None:
    angle = np.radians(degrees)
    light = sun([np.sin(angle), -np.cos(angle), 0], [1, 2, 3])
    expected = np.cos(angle) * np.array([0.5, 0.25, 1.0]) * [1, 2, 3] * 0.9
    assert np.abs(one_pixel(light, quality) - expected).max() <= 8 * 2.0**-24


@BOTH
@pytest.mark.parametrize("shininess", [0, 0.5, 1, 20, 128, 129, 1e4, 1e7])
@pytest.mark.parametrize("degrees", [0, 0.01, 5, 44, 80])
def test_a_highlight_is_the_power_of_its_cosine(degrees: float, shininess: float, quality: Any) -> None:
    """A light straight into the eye's mirror image, and beside it; up to 128 the power may be float32."""
    angle = np.radians(degrees)
    found = one_pixel(
        sun([np.sin(angle), -np.cos(angle), 0], [1, 1, 1]),
        quality,
        diffuse=0.0,
        specular=0.75,
        shininess=shininess,
    )
    expected = 0.75 * float(mpmath.cos(mpmath.mpf(float(angle))) ** mpmath.mpf(shininess))
    bound = 1e-6 if shininess > 128 or quality is DOUBLE else 6 * max(shininess, 1) * 2.0**-24
    assert np.abs(found - expected).max() <= bound * max(expected, 1e-3) + 2.0**-25
    assert found.max() <= 0.75


@BOTH
@pytest.mark.parametrize("shininess", [0, 0.5, 50.5, 900])
def test_there_is_no_highlight_where_the_mirrored_light_faces_away(shininess: float, quality: Any) -> None:
    """r . v = 0, below 0, and all but 0: 0 to the power of 0 is no light."""
    low = camera(position=[4, 0.5, 0], look_at=[0, 0, 0], width=1, height=1)
    for direction in ([-1, -0.1, 0], [-1, -1, 0], [-0.125, -1, 0], [-0.126, -1, 0]):
        found = one_pixel(sun(direction), quality, low, diffuse=0.0, specular=1.0, shininess=shininess)
        cosine = np.dot(
            np.array([direction[0], -direction[1], 0]) / np.hypot(*direction[:2]),
            np.array([4, 0.5, 0]) / np.hypot(4, 0.5),
        )
        assert cosine < 1e-15
        assert not found.any()


@BOTH
def test_a_light_below_the_horizon_gives_no_highlight_either(quality: Any) -> None:
    for light in (bulb([0, -1e-3, 0]), sun([0.3, 1e-9, 0]), sun([1, 0, 0])):
        assert not one_pixel(light, quality, specular=1.0, shininess=0).any()


@BOTH
def test_a_highlight_has_the_lights_colour_not_the_surfaces(quality: Any) -> None:
    found = one_pixel(sun([0, -1, 0], [0.2, 0.4, 0.6]), quality, diffuse=0.0, specular=0.5, shininess=9)
    assert np.abs(found - [0.1, 0.2, 0.3]).max() <= 2.0**-22


@BOTH
def test_lights_add_up(quality: Any) -> None:
    lights = [sun([0, -1, 0]), bulb([1, 2, 0]), sun([0.5, -1, 0.3])]
    together = image_of(_lit(lights), quality)
    apart = sum(image_of(_lit([light]), quality).astype(np.float64) for light in lights)
    assert np.abs(together - apart).max() <= 8 * 2.0**-24


def _lit(lights: list[Json]) -> Json:
    return scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
        lights=lights,
        ambient=[0, 0, 0],
        background=[0, 0, 0],
        materials={"plain": phong(ambient=0.0, specular=0.4, shininess=30)},
    )


@BOTH
@pytest.mark.parametrize(
    "texel", [(128, 128, 255), (128, 128, 128), (0, 0, 0), (128, 128, 0), (255, 0, 0), (0, 0, 255)]
)
def test_no_texel_of_a_normal_map_breaks_the_picture(texel: tuple[int, int, int], quality: Any) -> None:
    """Flat, silent, all black, and pointing inwards: finite, never negative, flat as without a map."""
    from tests.images.parts import png

    document = scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
        lights=[sun([0.2, -1, 0.1])],
        textures={"n": {"type": "image", "asset": "n.png", "encoding": "linear"}},
        materials={"plain": phong(normal_map="n", specular=0.3, shininess=5)},
    )
    files = {"n.png": png(np.full((1, 1, 3), texel, dtype=np.uint8))}
    image = image_of(document, quality, files=files)
    assert np.isfinite(image).all()
    assert image.min() >= 0
    if texel in {(128, 128, 255), (128, 128, 128)}:
        plain = document | {"materials": {"plain": phong(specular=0.3, shininess=5)}}
        assert np.abs(image - image_of(plain, quality)).max() <= (0 if texel[2] == 128 else 0.01)
