"""A small scene with all that a study takes apart: an area light, a shadow, highlights, a texture's edge."""

import json
from typing import Any

from accuracy.study.settings import Scale
from renderer import LoadedScene, load_scene

SCENE: dict[str, Any] = {
    "version": 1,
    "name": "small & <b>bold</b>",
    "camera": {"position": [0, 2, 6], "look_at": [0, 0.4, 0], "vertical_fov": 38, "width": 40, "height": 30},
    "background": [0.2, 0.3, 0.4],
    "ambient": [1, 1, 1],
    "materials": {
        "floor": {"type": "phong", "color": [0.7, 0.7, 0.7]},
        "ball": {"type": "phong", "color": [0.6, 0.2, 0.1], "specular": 0.4, "shininess": 20},
    },
    "shapes": [
        {
            "type": "rectangle",
            "center": [0, 0, 0],
            "normal": [0, 1, 0],
            "tangent": [1, 0, 0],
            "size": [4, 4],
            "material": "floor",
        },
        {"type": "ellipsoid", "center": [0, 0.6, 0], "radius": 0.6, "material": "ball"},
    ],
    "lights": [
        {
            "type": "rectangle",
            "center": [1, 3, 1],
            "normal": [0, -1, 0],
            "tangent": [1, 0, 0],
            "size": [1, 1],
            "color": [0.8, 0.8, 0.8],
        }
    ],
    "sampling": {"antialiasing": {"pattern": "uniform", "samples": 4}, "light": {"samples": 4}},
}

TINY = Scale(
    side=20,
    references=(16, 4),
    random=((1, 1), (4, 1), (16, 1)),
    regular=((1, 1), (4, 1), (4, 4)),
    errors_255=(8.0,),
    seeds=2,
)
"""Some 40 runs of some milliseconds each."""


def scene(**members: Any) -> LoadedScene:
    """The small scene, with other members of its document."""
    return load_scene({**json.loads(json.dumps(SCENE)), **members})
