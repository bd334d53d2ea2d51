"""What the benchmarks of the page render."""

from __future__ import annotations

from typing import Any


def ball(side: int, **rest: Any) -> dict[str, Any]:
    """A ball under a light; ``rest`` are further members of the scene, such as its sampling."""
    return {
        "version": 1,
        "camera": {
            "position": [0, 0, 4],
            "look_at": [0, 0, 0],
            "vertical_fov": 40,
            "width": side,
            "height": side,
        },
        "materials": {"red": {"type": "phong", "color": [0.8, 0.2, 0.1], "diffuse": 1.0}},
        "shapes": [{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "red"}],
        "lights": [{"type": "point", "position": [2, 3, 4], "color": [1, 1, 1]}],
        **rest,
    }
