"""A camera and a light for a mesh that came without."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from renderer.math.arrays import Floats

FIELD_OF_VIEW = 40.0
SIZE = 512
MARGIN = 1.05
"""The mesh's sphere is taken so much larger: a border around it, and room for the rounding below."""
DIGITS = 3
"""Decimals, in units of the power of ten above the radius, of the numbers that people read in the scene."""
FROM_VIEWER = (1.0, 1.0, 2.0)
"""The camera stands in front, to the right and above: three sides of a box are seen."""
FROM_LIGHT = (-1.0, 3.0, 2.0)
"""The light comes from above, over the viewer's left shoulder, so that shadows fall to the right."""
LIGHT_DISTANCE = 3.0
"""In radii of the mesh. The light is as wide as one radius: a soft shadow."""


def bounding_sphere(vertices: Floats) -> tuple[Floats, float]:
    """Middle (3,) of the bounding box of vertices (N, 3), and half its diagonal; 1 where that is 0."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low)) / 2 or 1.0


def default_camera(middle: Floats, radius: float) -> dict[str, Any]:
    """A camera that sees the whole sphere, y upwards."""
    distance = MARGIN * radius / math.sin(math.radians(FIELD_OF_VIEW / 2))
    direction = np.array(FROM_VIEWER) / np.linalg.norm(FROM_VIEWER)
    return {
        "position": _rounded(middle + distance * direction, radius),
        "look_at": _rounded(middle, radius),
        "up": [0, 1, 0],
        "vertical_fov": FIELD_OF_VIEW,
        "width": SIZE,
        "height": SIZE,
    }


def default_light(middle: Floats, radius: float) -> dict[str, Any]:
    """A square light that the camera does not see."""
    direction = np.array(FROM_LIGHT) / np.linalg.norm(FROM_LIGHT)
    side = _rounded(np.array([radius]), radius)[0]
    return {
        "type": "rectangle",
        "center": _rounded(middle + LIGHT_DISTANCE * radius * direction, radius),
        "normal": [-number for number in FROM_LIGHT],
        "tangent": [1, 0, 0],
        "size": [side, side],
        "color": [0.9, 0.9, 0.9],
        "visible": False,
    }


def _rounded(numbers: Floats, radius: float) -> list[float]:
    decimals = DIGITS - math.floor(math.log10(radius))
    return [round(float(number), decimals) for number in numbers]
