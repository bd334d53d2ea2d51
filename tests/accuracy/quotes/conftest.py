from typing import Any

import pytest

import renderer
from renderer.scenes import LoadedScene


def edge(width: int = 64, height: int = 32, **sampling: Any) -> dict[str, Any]:
    """A black picture whose right part is grey: the edge runs down the middle of a column of pixels."""
    return {
        "version": 1,
        "camera": {"position": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov": 90, "width": width,
                   "height": height},
        "ambient": [1, 1, 1],
        "materials": {"grey": {"type": "phong", "color": [0.5, 0.5, 0.5], "ambient": 1, "diffuse": 0}},
        "shapes": [
            {"type": "rectangle", "corner": [1 / height, -9, 0], "edges": [[9, 0, 0], [0, 18, 0]],
             "material": "grey"}
        ],
        "sampling": sampling,
    }  # fmt: skip


@pytest.fixture
def ball_scene() -> LoadedScene:
    """A ball over a floor under a square light."""
    return renderer.load_scene(
        {
            "version": 1,
            "camera": {"position": [0, 2, 6], "look_at": [0, 0.5, 0], "vertical_fov": 40, "width": 48,
                       "height": 40},
            "ambient": [1, 1, 1],
            "materials": {
                "floor": {"type": "phong", "color": [0.7, 0.7, 0.7], "ambient": 0.1},
                "ball": {"type": "phong", "color": [0.7, 0.2, 0.1], "ambient": 0.1, "specular": 0.3},
            },
            "shapes": [
                {"type": "rectangle", "center": [0, 0, 0], "normal": [0, 1, 0], "tangent": [1, 0, 0],
                 "size": [8, 8], "material": "floor"},
                {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "ball"},
            ],
            "lights": [
                {"type": "rectangle", "center": [0, 4, 0], "normal": [0, -1, 0], "tangent": [1, 0, 0],
                 "size": [1, 1], "color": [0.8, 0.8, 0.8]}
            ],
            "sampling": {"antialiasing": {"pattern": "rotated", "samples": 9},
                         "light": {"pattern": "stratified", "samples": 4}},
        }
    )  # fmt: skip
