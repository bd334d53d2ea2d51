"""Building blocks for the scenes of the ready assignment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.make_hard_scenes import DIGITS

Json = dict[str, Any]

FOLDER = Path(__file__).parent / "assignment"
WIDTH, HEIGHT = 128, 96
"""Pixels: enough for blocks of 8 x 8, few enough for a slow program to render in a minute."""

SAMPLES = 16
"""Camera samples per pixel in the assignment."""

COLORS = {
    "red": [0.75, 0.15, 0.1],
    "green": [0.15, 0.6, 0.2],
    "blue": [0.15, 0.25, 0.8],
    "yellow": [0.8, 0.7, 0.15],
    "white": [0.8, 0.8, 0.8],
    "violet": [0.5, 0.2, 0.6],
}


FULL_MOON = {"type": "directional", "direction": [0, 0, -1], "color": [1, 1, 1]}
"""The light of scenes that show no shading."""

NIGHT = [0.05, 0.06, 0.1]
"""The background of scenes that show how shapes are lit."""

DAY = [0.75, 0.68, 0.5]
"""The background of black shapes."""


def camera(position: list[float], look_at: list[float], fov: float) -> Json:
    """A camera with the picture size of the assignment."""
    place = {"position": position, "look_at": look_at, "vertical_fov": fov}
    return {**place, "width": WIDTH, "height": HEIGHT}


def scene(
    name: str,
    view: Json,
    shapes: list[Json],
    lights: list[Json] | None = None,
    *,
    materials: Json,
    background: list[float] = NIGHT,
) -> Json:
    """A scene with the sampling of the assignment."""
    used = {shape["material"] for shape in shapes}
    random = {"pattern": "random", "samples": SAMPLES}
    return {
        "version": 1,
        "name": name,
        "camera": view,
        "background": background,
        "ambient": [1, 1, 1],
        "materials": {key: materials[key] for key in materials if key in used},
        "shapes": shapes,
        "lights": lights or [FULL_MOON],
        "sampling": {"antialiasing": random, "light": {"pattern": "random", "samples": 1}, "seed": 0},
    }


def phong(color: list[float], **changes: Any) -> Json:
    """A matte material with a little ambient light."""
    return {"type": "phong", "color": color, "ambient": 0.1, "diffuse": 0.9, "specular": 0, **changes}


def flat() -> Json:
    """Materials that show only their colour, in ambient light."""
    return {name: phong(color, ambient=1, diffuse=0) for name, color in COLORS.items()}


def black() -> Json:
    """A material that is black in any light, so that only positions are visible, however it is shaded."""
    return {"black": phong([0, 0, 0])}


def matte() -> Json:
    """Materials without highlights."""
    return {name: phong(color) for name, color in COLORS.items()}


def ball(center: list[float], radius: float, material: str) -> Json:
    """A sphere."""
    return {"type": "ellipsoid", "center": center, "radius": round(radius, 4), "material": material}


def ellipsoid(center: list[float], axes: list[list[float]], material: str) -> Json:
    """An ellipsoid with three semi-axes."""
    return {"type": "ellipsoid", "center": center, "axes": axes, "material": material}


def triangle(a: list[float], b: list[float], c: list[float], material: str) -> Json:
    """A flat triangle."""
    vertices = [[round(x, DIGITS) for x in corner] for corner in (a, b, c)]
    return {"type": "triangle", "vertices": vertices, "material": material}
