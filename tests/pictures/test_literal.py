"""Pictures against `literal`, which draws the same scenes from the document of the scene language alone."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from schemas.reading import read_scene
from tests.documents import Json, bulb, camera, lamp, phong, sampled, sun
from tests.pictures import pictures
from tests.pictures.literal import Codes, Drawing
from tests.pictures.parts import DOUBLE, SINGLE, image_of, plan_of, png, samples_of

PICTURE = pictures.codes(6, 5)
BUMPS = pictures.bumps()
CODES: dict[str, Codes] = {"picture.png": PICTURE.tolist(), "bumps.png": BUMPS.tolist()}
FILES = {"picture.png": png(PICTURE), "bumps.png": png(BUMPS)}

NEAR = {"camera": camera(position=[0.3, 1.7, 4.4], look_at=[0.1, 1.4, 0])}
OUTSIDE = [bulb([1.3, 3.2, 40]), lamp([-2, 9.2, 1], [3, 0, 0.2], [0, 0.3, 2])]
WITHIN = [bulb([1.3, 3.2, 0.9]), lamp([-2, 4.2, 1], [3, 0, 0.2], [0, 0.3, 2], visible=False)]

BY_CENTER = {
    "type": "rectangle",
    "center": [0.2, 3.7, -0.3],
    "normal": [0.2, -2, 0.1],
    "tangent": [1, 0.4, 0.3],
    "size": [1.4, 0.6],
    "color": [0.6, 0.7, 0.8],
    "two_sided": False,
}

SCENES: dict[str, Json] = {
    "lamp by its centre": pictures.of_room(lights=[BY_CENTER]),
    "room with every kind of shape": pictures.of_room(),
    "center pattern": pictures.of_room(sampling=sampled(1, 9, "center")),
    "rotated pattern": pictures.of_room(sampling=sampled(9, 1, "rotated")),
    "skew parallelograms": pictures.skew(),
    "four lights": pictures.many_lights(),
    "sun alone": pictures.of_room(lights=[sun([-0.5, -0.8, -1.3])], sampling=sampled(4)),
    "one-sided lamp": pictures.one_sided(),
    "lamps in a ball": pictures.lamp_in_ball(0.9, [0.2, 1.5, 0.1]),
    "bulb below the skin of a ball": pictures.lamp_in_ball(0.9, [0.3, 1.6, 0.9]),
    "camera in an ellipsoid with the lights": pictures.inside_a_ball(
        pictures.triangle([-1, 0, 1], [1.3, 0.3, 0.4], [0.2, 2.4, 0.6]), lights=WITHIN
    ),
    "camera in an ellipsoid, lights outside": pictures.inside_a_ball(
        pictures.triangle([-1, 0, 1], [1.3, 0.3, 0.4], [0.2, 2.4, 0.6]), lights=OUTSIDE
    ),
    "camera in an ellipsoid and nothing else, lights outside": pictures.inside_a_ball(lights=OUTSIDE),
    "lamp through the skin of the ellipsoid around the camera": pictures.inside_a_ball(
        lights=[lamp([1, 5, 0.4], [0.5, 4.1, 0.3], [1, 0.2, -2])]
    ),
    "smooth normals": pictures.smooth(),
    **{f"shininess {power}": pictures.gloss(power) for power in (0, 20, 128, 500, 10000)},
    "shininess 0 with lamps on all sides": pictures.many_lights()
    | {"materials": {name: phong(specular=0.5, shininess=0) for name in ("plain", "shiny")}},
    "checker": pictures.checkered(),
    "normal map": pictures.carved(),
    "normal map, nearest": pictures.carved("nearest"),
    "visible lamp in the ceiling": pictures.lamp_in_ceiling(),
    "camera in the room": pictures.of_room(**NEAR, sampling=sampled(1, 4)),
    **{
        f"picture, {filter_}, {wrap}": pictures.textured(filter=filter_, wrap=wrap)
        for filter_ in ("nearest", "bilinear")
        for wrap in ("clamp", "repeat", "mirror")
    },
    "picture in sRGB": pictures.textured(encoding="srgb"),
}


def literal(document: Mapping[str, Any]) -> NDArray[np.float64]:
    return np.array(Drawing(read_scene(document)[0], CODES).samples())


@pytest.fixture(scope="module")
def drawn() -> dict[str, NDArray[np.float64]]:
    """Drawings that several tests compare with."""
    return {}


def drawing(name: str, drawn: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    if name not in drawn:
        drawn[name] = literal(SCENES[name])
    return drawn[name]


@pytest.mark.parametrize("name", SCENES)
def test_samples_against_the_tracer(name: str, drawn: dict[str, NDArray[np.float64]]) -> None:
    """In double precision the two differ by rounding: 1e-9 leaves room for a power of 1e4 of a cosine.

    No sample is left out. A pair of point and light point on the border between light and shadow would
    differ by a whole light point; at 1e-15 of the border none of these scenes has one.
    """
    expected = drawing(name, drawn)
    # The curve of sRGB is formed twice and rounded to float32, perhaps to the next number.
    bound = 2.0**-22 if name == "picture in sRGB" else 1e-9
    assert np.abs(samples_of(plan_of(SCENES[name], DOUBLE, files=FILES)) - expected).max() <= bound


@pytest.mark.parametrize("name", SCENES)
def test_single_precision_against_the_tracer(name: str, drawn: dict[str, NDArray[np.float64]]) -> None:
    """Up to the power 128 cosines are float32: a dozen roundings of 2**-24, times the power.

    Larger powers are float64. A pair within 1e-6 of the border of a shadow might differ; there is none.
    """
    expected = drawing(name, drawn).mean(axis=2)
    assert np.abs(image_of(SCENES[name], SINGLE, files=FILES) - expected).max() <= 12 * 128 * 2.0**-24


@pytest.mark.parametrize("name", ["room with every kind of shape", "rotated pattern", "picture in sRGB"])
def test_pixel_is_the_mean_of_its_samples(name: str, drawn: dict[str, NDArray[np.float64]]) -> None:
    """Passes are rounded to float32, and their mean once more."""
    expected = drawing(name, drawn).mean(axis=2)
    assert np.abs(image_of(SCENES[name], DOUBLE, files=FILES) - expected).max() <= 3 * 2.0**-24
