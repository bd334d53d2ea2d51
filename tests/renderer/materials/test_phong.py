"""Phong's model in closed form, at the ends of its numbers."""

from typing import Any

import mpmath
import numpy as np
import pytest

from tests.documents import camera, phong, rectangle, scene, sun
from tests.pictures.parts import DOUBLE, SINGLE, image_of


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("shininess", [0, 0.5, 1, 20, 128, 129, 1e4, 1e7])
@pytest.mark.parametrize("degrees", [0, 0.01, 5, 44, 80])
def test_highlight_is_the_power_of_its_cosine(degrees: float, shininess: float, quality: Any) -> None:
    """A light straight into the eye's mirror image, and beside it; up to 128 the power may be float32."""
    angle = np.radians(degrees)
    document = scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
        camera=camera(position=[0, 4, 0], look_at=[0, 0, 0], up=[0, 0, -1], width=1, height=1),
        lights=[sun([np.sin(angle), -np.cos(angle), 0], [1, 1, 1])],
        ambient=[0, 0, 0],
        materials={"plain": phong(ambient=0.0, diffuse=0.0, specular=0.75, shininess=shininess)},
    )
    found = image_of(document, quality)[0, 0]
    expected = 0.75 * float(mpmath.cos(mpmath.mpf(float(angle))) ** mpmath.mpf(shininess))
    bound = 1e-6 if shininess > 128 or quality is DOUBLE else 6 * max(shininess, 1) * 2.0**-24
    assert np.abs(found - expected).max() <= bound * max(expected, 1e-3) + 2.0**-25
    assert found.max() <= 0.75
