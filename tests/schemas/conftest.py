from typing import Any

import pytest


@pytest.fixture
def scene() -> dict[str, Any]:
    """A valid scene that uses every kind of object once and causes no warning."""
    return {
        "version": 1,
        "name": "all kinds",
        "camera": {"position": [0, 2, 8], "look_at": [0, 1, 0], "up": [0, 1, 0], "vertical_fov": 40.5},
        "background": [0, 0, 0],
        "ambient": [1, 1, 1],
        "textures": {
            "wood": {"type": "image", "asset": "wood.png", "encoding": "linear", "filter": "nearest"},
            "board": {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [8, 8]},
        },
        "materials": {
            "plain": {"type": "phong", "color": [0.5, 0.5, 0.5], "specular": 0.3, "shininess": 40},
            "carved": {"type": "phong", "color_texture": "board", "normal_map": "wood"},
        },
        "shapes": [
            {"type": "triangle", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "material": "plain"},
            {
                "type": "rectangle",
                "center": [0, 0, 0],
                "normal": [0, 1, 0],
                "tangent": [1, 0, 0],
                "size": [4, 4],
                "material": "carved",
            },
            {"type": "rectangle", "corner": [0, 0, 0], "edges": [[1, 0, 0], [1, 1, 0]], "material": "plain"},
            {
                "type": "ellipsoid",
                "center": [0, 1, 0],
                "axes": [[1, 0, 0], [0, 2, 0], [0, 0, 3]],
                "material": "plain",
            },
            {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "plain"},
        ],
        "lights": [
            {
                "type": "rectangle",
                "center": [0, 5, 0],
                "normal": [0, -1, 0],
                "tangent": [1, 0, 0],
                "size": [1, 1],
                "color": [1, 1, 1],
            },
            {"type": "rectangle", "corner": [0, 6, 0], "edges": [[1, 0, 0], [0, 0, 1]], "color": [1, 1, 1]},
            {"type": "point", "position": [0, 7, 0], "color": [1, 1, 1]},
            {"type": "spot", "position": [0, 7, 0], "direction": [0, -1, 0], "color": [1, 1, 1]},
            {"type": "directional", "direction": [0, -1, 0], "color": [1, 1, 1]},
        ],
        "sampling": {
            "antialiasing": {"pattern": "uniform", "samples": 16},
            "light": {"pattern": "sobol", "samples": 7},
            "seed": 3,
        },
        "display": {"transfer": "srgb", "exposure": 0},
    }
