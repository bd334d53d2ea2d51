"""The same scene elsewhere: turned, moved, or in other units."""

from collections.abc import Callable
from typing import Any

import numpy as np

from accuracy.hard_cases.documents import Json
from renderer.math.arrays import Floats

Change = Callable[[Any], Floats]

PLACES = {"corner", "center", "position", "look_at", "vertices"}
VECTORS = {"edges", "axes"}
DIRECTIONS = {"up", "normal", "tangent", "direction", "normals"}
LENGTHS = {"radius", "size", "lens_radius", "focus_distance", "bump_height", "displacement_height"}

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A quarter turn about z, exact."""


def turn(degrees: float, axis: tuple[float, float, float] = (0.6, 0.48, 0.64)) -> Floats:
    """The matrix (3, 3) of a turn about a unit vector, to rounding."""
    x, y, z = axis
    angle = np.radians(degrees)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def placed(document: Json, scale: float = 1.0, offset: float = 0.0, turned: Floats | None = None) -> Json:
    """A scene turned about the origin, then moved along (1, -1, 1), then scaled.

    Point lights with physical falloff would need other colours, and meshes of files another `translate`:
    neither is looked after.
    """
    matrix = np.eye(3) if turned is None else turned
    away = np.array([offset, -offset, offset])
    changes: dict[str, Change] = {
        **dict.fromkeys(PLACES, lambda x: (_each(x, matrix) + away) * scale),
        **dict.fromkeys(VECTORS, lambda x: _each(x, matrix) * scale),
        **dict.fromkeys(DIRECTIONS, lambda x: _each(x, matrix)),
        **dict.fromkeys(LENGTHS, lambda x: np.asarray(x) * scale),
    }

    def part(item: Json) -> Json:
        return {k: changes[k](v).tolist() if k in changes else v for k, v in item.items()}

    return {
        **document,
        "camera": part({"up": [0, 1, 0], **document["camera"]}),
        "materials": {name: part(item) for name, item in document["materials"].items()},
        "shapes": [part(item) for item in document["shapes"]],
        "lights": [part(item) for item in document["lights"]],
    }


def _each(vectors: Any, matrix: Floats) -> Floats:
    """Every vector (..., 3) turned; each component is a sum over its own row alone."""
    given = np.asarray(vectors, dtype=np.float64)
    return np.stack([(given * row).sum(axis=-1) for row in matrix], axis=-1)
