"""Scenes and their parts as a user writes them, with plain values for what does not matter."""

from typing import Any

Json = dict[str, Any]


def camera(**changes: Any) -> Json:
    """A camera before the origin with 24 x 16 pixels."""
    return {
        "position": [0.3, 1.7, 6.1],
        "look_at": [0.1, 1.4, 0],
        "vertical_fov": 44,
        "width": 24,
        "height": 16,
        **changes,
    }


def phong(color: list[float] | None = None, **changes: Any) -> Json:
    """A matt material."""
    base = {} if "color_texture" in changes else {"color": color or [0.8, 0.7, 0.6]}
    return {"type": "phong", **base, "ambient": 0.2, "diffuse": 0.9, **changes}


def rectangle(corner: list[float], first: list[float], second: list[float], **changes: Any) -> Json:
    """By a corner and two edges."""
    return {"type": "rectangle", "corner": corner, "edges": [first, second], "material": "plain", **changes}


def triangle(*vertices: list[float], **changes: Any) -> Json:
    """By its vertices."""
    return {"type": "triangle", "vertices": list(vertices), "material": "plain", **changes}


def sphere(center: list[float], radius: float, **changes: Any) -> Json:
    """By centre and radius."""
    return {"type": "ellipsoid", "center": center, "radius": radius, "material": "plain", **changes}


def ellipsoid(center: list[float], *axes: list[float], **changes: Any) -> Json:
    """By centre and semi-axes."""
    return {"type": "ellipsoid", "center": center, "axes": list(axes), "material": "plain", **changes}


def lamp(
    corner: list[float], first: list[float], second: list[float], color: Any = (0.9, 0.8, 0.7), **more: Any
) -> Json:
    """A rectangle light by a corner and two edges."""
    return {"type": "rectangle", "corner": corner, "edges": [first, second], "color": list(color), **more}


def bulb(position: list[float], color: Any = (0.5, 0.6, 0.7)) -> Json:
    """A point light."""
    return {"type": "point", "position": position, "color": list(color)}


def sun(direction: list[float], color: Any = (0.4, 0.3, 0.5)) -> Json:
    """A directional light."""
    return {"type": "directional", "direction": direction, "color": list(color)}


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


def room() -> list[Json]:
    """Floor, ceiling, back and side walls that share corners and edges bit for bit."""
    return [
        rectangle([-2, 0, -2], [0, 0, 4], [4, 0, 0]),
        rectangle([-2, 4, -2], [4, 0, 0], [0, 0, 4]),
        rectangle([-2, 0, -2], [4, 0, 0], [0, 4, 0]),
        rectangle([-2, 0, -2], [0, 4, 0], [0, 0, 4]),
        rectangle([2, 0, -2], [0, 0, 4], [0, 4, 0]),
    ]
