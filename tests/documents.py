"""Scenes and their parts as a user writes them, with plain values for what does not matter."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.math.arrays import Floats

Json = dict[str, Any]

Vector = Sequence[float] | Floats
"""Three numbers."""


PLAIN = {"material": "plain"}


def written(fields: Json) -> Json:
    """An object of the scene language; arrays become lists."""
    return {name: _plain(value) for name, value in fields.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list) else value


def camera(**changes: Any) -> Json:
    """A camera before the origin with 24 x 16 pixels."""
    usual = {
        "position": [0.3, 1.7, 6.1],
        "look_at": [0.1, 1.4, 0],
        "vertical_fov": 44,
        "width": 24,
        "height": 16,
    }
    return written({**usual, **changes})


def phong(color: Sequence[float] | None = None, **changes: Any) -> Json:
    """A matte material."""
    base = {} if "color_texture" in changes else {"color": color or [0.8, 0.7, 0.6]}
    return {"type": "phong", **base, "ambient": 0.2, "diffuse": 0.9, **changes}


def rectangle(corner: Vector, first: Vector, second: Vector, **changes: Any) -> Json:
    """By a corner and two edges."""
    return written({"type": "rectangle", "corner": corner, "edges": [first, second], **PLAIN, **changes})


def triangle(*vertices: Vector, **changes: Any) -> Json:
    """By its vertices."""
    return written({"type": "triangle", "vertices": list(vertices), **PLAIN, **changes})


def mesh(vertices: Any, triangles: Any, **changes: Any) -> Json:
    """By vertices (V, 3) and the numbers of those of each triangle (T, 3)."""
    parts = {"vertices": np.asarray(vertices), "triangles": np.asarray(triangles)}
    return written({"type": "mesh", **parts, **PLAIN, **changes})


def sphere(center: Vector, radius: float, **changes: Any) -> Json:
    """By centre and radius."""
    return written({"type": "ellipsoid", "center": center, "radius": radius, **PLAIN, **changes})


def ellipsoid(center: Vector, *axes: Vector, **changes: Any) -> Json:
    """By centre and semi-axes."""
    return written({"type": "ellipsoid", "center": center, "axes": list(axes), **PLAIN, **changes})


def lamp(corner: Vector, first: Vector, second: Vector, color: Any = (0.9, 0.8, 0.7), **more: Any) -> Json:
    """A rectangle light by a corner and two edges."""
    return written(
        {"type": "rectangle", "corner": corner, "edges": [first, second], "color": list(color), **more}
    )


def bulb(position: Vector, color: Any = (0.5, 0.6, 0.7)) -> Json:
    """A point light."""
    return written({"type": "point", "position": position, "color": list(color)})


def spot(position: Vector, direction: Vector, color: Any = (0.5, 0.6, 0.7), **more: Any) -> Json:
    """A light at a point that shines into a cone."""
    return written(
        {"type": "spot", "position": position, "direction": direction, "color": list(color), **more}
    )


def sun(direction: Vector, color: Any = (0.4, 0.3, 0.5)) -> Json:
    """A directional light."""
    return written({"type": "directional", "direction": direction, "color": list(color)})


def sampled(
    samples: int = 1, points: int = 1, pattern: str = "uniform", light: str = "uniform", seed: int = 0
) -> Json:
    """One seed and two patterns."""
    return {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": light, "samples": points},
        "seed": seed,
    }


def scene(*shapes: Json, lights: Any = (), **changes: Any) -> Json:
    """Shapes of material `plain` before the camera."""
    return {
        "version": 1,
        "camera": camera(),
        "background": [0.05, 0.1, 0.2],
        "ambient": [1, 0.9, 0.8],
        "materials": {"plain": phong()},
        "shapes": list(shapes),
        "lights": list(lights),
        "sampling": sampled(),
        **changes,
    }


def dark_scene(*shapes: Json, **changes: Any) -> Json:
    """A scene where nothing but lights shines, on white matte shapes unless changed."""
    white = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}
    return scene(*shapes, **{"ambient": [0, 0, 0], "background": [0, 0, 0], "materials": white, **changes})


def room() -> list[Json]:
    """Floor, ceiling, back and side walls that share corners and edges bit for bit."""
    return [
        rectangle([-2, 0, -2], [0, 0, 4], [4, 0, 0]),
        rectangle([-2, 4, -2], [4, 0, 0], [0, 0, 4]),
        rectangle([-2, 0, -2], [4, 0, 0], [0, 4, 0]),
        rectangle([-2, 0, -2], [0, 4, 0], [0, 0, 4]),
        rectangle([2, 0, -2], [0, 0, 4], [0, 4, 0]),
    ]
