"""What meshes of all formats get: a scene around them."""

from __future__ import annotations

from typing import Any

from renderer.math.arrays import Floats
from service.converting.surroundings import bounding_sphere, default_camera, default_light
from service.converting.task import Task


def scene_around(
    task: Task,
    vertices: Floats,
    *,
    textures: dict[str, Any],
    materials: dict[str, Any],
    shapes: list[dict[str, Any]],
    camera: dict[str, Any] | None = None,
    lights: list[dict[str, Any]] | None = None,
) -> dict[str, Any]:
    """A scene of some shapes.

    Parameters
    ----------
    task
        What is assumed is noted in it.
    vertices
        All points of the shapes, (N, 3), scene units.
    textures, materials, shapes
        Parts of the scene.
    camera
        In place of one that sees everything.
    lights
        In place of a soft light from above.
    """
    middle, radius = bounding_sphere(vertices)
    scene: dict[str, Any] = {"version": 1, "name": task.path.stem}
    if camera is None:
        task.notes.assume(
            "", "The camera looks from the front, right and above at all of the mesh; y is upwards."
        )
        camera = default_camera(middle, radius)
    scene["camera"] = camera
    if not lights:
        task.notes.assume(
            "", "A square light from above left, and ambient light of 1: materials give back a tenth of it."
        )
        scene["ambient"] = [1, 1, 1]
        lights = [default_light(middle, radius)]
    if textures:
        scene["textures"] = textures
    return scene | {"materials": materials, "shapes": shapes, "lights": lights}
