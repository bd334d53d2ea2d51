"""Warnings: scenes that are valid, but whose picture is probably not what was meant."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from schemas.findings import Finding
from schemas.geometry import in_view, inside, light_points, no_area, no_area_at_all
from schemas.quantities import Color
from schemas.references import used_materials, used_textures
from schemas.scene import Scene
from schemas.shapes import Ellipsoid, Mesh, Sphere, Triangle
from schemas.vectors import difference, length, parallel

FLATTEST = 1e8
"""Largest ratio of two semi-axes of an ellipsoid that keeps its picture exact."""

NARROWEST = 2.0**-45
"""Angle from pixel to pixel, radians, of which the rounding of a ray's direction is a hundredth."""

# A warning is a courtesy: it must not cost more than the reading.
_MOST_PAIRS = 100_000


def advise(scene: Scene) -> list[Finding]:
    """List what is valid, but probably not meant."""
    return [
        *_darkness(scene),
        *_empty_view(scene),
        *_narrow_view(scene),
        *_bright_colors(scene),
        *_up(scene),
        *_unused(scene),
        *_poor_shapes(scene),
        *_lights_inside(scene),
    ]


def _black(color: Color) -> bool:
    return not any(color)


def _darkness(scene: Scene) -> Iterator[Finding]:
    if not all(_black(light.color) for light in scene.lights):
        return
    ambient = not _black(scene.ambient) and any(material.ambient for material in scene.materials.values())
    if ambient:
        detail = "No light shines: every shape shows its ambient colour only. Add a light."
        yield Finding(("lights",), "no_light", detail)
    else:
        detail = "No light shines and there is no ambient light: every shape is black. Add a light."
        yield Finding(("lights",), "black_picture", detail)


def _empty_view(scene: Scene) -> Iterator[Finding]:
    if not in_view(scene):
        detail = "No shape is in view: the picture shows the background only. Turn or move the camera."
        yield Finding(("camera",), "nothing_in_view", detail)


def _narrow_view(scene: Scene) -> Iterator[Finding]:
    camera = scene.camera
    if math.radians(camera.vertical_fov) < NARROWEST * camera.height:
        detail = (
            "The view is so narrow that rounding moves rays by a hundredth of a pixel or more. "
            "Move the camera nearer and widen the view."
        )
        yield Finding(("camera", "vertical_fov"), "narrow_view", detail)


def _bright_colors(scene: Scene) -> Iterator[Finding]:
    for name, material in scene.materials.items():
        if material.color and max(material.color) > 1:
            detail = (
                "This colour gives back more light than it receives. Colours are linear, 0 to 1: divide "
                "values of 0 to 255 by 255 and decode them from sRGB."
            )
            yield Finding(("materials", name, "color"), "bright_color", detail)


def _up(scene: Scene) -> Iterator[Finding]:
    camera = scene.camera
    if parallel(difference(camera.look_at, camera.position), camera.up):
        detail = (
            "'up' is parallel to the view, so the world axis that is farthest from the view takes its place. "
            "Choose another direction to set how the picture is turned."
        )
        yield Finding(("camera", "up"), "up_parallel_to_view", detail)


def _unused(scene: Scene) -> Iterator[Finding]:
    parts = {"materials": scene.materials, "shapes": scene.shapes}
    materials = {name for _, name in used_materials(parts)}
    textures = {name for _, name in used_textures(parts)}
    for name in scene.materials:
        if name not in materials:
            yield Finding(("materials", name), "unused", "No shape uses this material. Use it or remove it.")
    for name in scene.textures:
        if name not in textures:
            yield Finding(("textures", name), "unused", "No material uses this texture. Use it or remove it.")


def _poor_shapes(scene: Scene) -> Iterator[Finding]:
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Triangle) and no_area(shape):
            detail = "This triangle has no area and is left out. Move one of its vertices or remove it."
            yield Finding(("shapes", index, "vertices"), "no_area", detail)
        if isinstance(shape, Mesh) and no_area_at_all(shape):
            detail = (
                "No triangle of this mesh has an area, so nothing of it is seen. Check its vertices and "
                "their numbers, or remove it."
            )
            yield Finding(("shapes", index, "triangles"), "no_area", detail)
        if isinstance(shape, Ellipsoid) and _flat(shape):
            detail = "One axis is more than 1e8 times as long as another: the picture may be inexact."
            yield Finding(("shapes", index, "axes"), "very_flat", detail)


def _flat(shape: Ellipsoid) -> bool:
    lengths = [length(axis) for axis in shape.axes]
    return max(lengths) > FLATTEST * min(lengths)


def _lights_inside(scene: Scene) -> Iterator[Finding]:
    round_shapes = [
        (index, shape) for index, shape in enumerate(scene.shapes) if isinstance(shape, Ellipsoid | Sphere)
    ]
    lights = enumerate(light_points(light) for light in scene.lights)
    pairs = itertools.islice(itertools.product(lights, round_shapes), _MOST_PAIRS)
    for (light, points), (index, shape) in pairs:
        if points and all(inside(point, shape) for point in points):
            detail = (
                f"This light is inside the ellipsoid /shapes/{index}, so everything outside is in its shadow."
            )
            yield Finding(("lights", light), "light_inside", detail)
