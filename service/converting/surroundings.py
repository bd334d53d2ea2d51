"""A scene around a bare mesh: a grey material, a camera that sees all of it, and a light."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats
from renderer.meshes.files import read_mesh
from renderer.meshes.ply_header import header_of
from service.converting.errors import wrong_at
from service.converting.task import UNUSABLE_FILE_ERRORS, One, Task, picture_file

DEFAULT_GREY = 0.75
"""Colour of faces without a material, and of materials without a colour."""
FIELD_OF_VIEW = 40.0
PICTURE_SIZE = 512
SPHERE_MARGIN = 1.05
"""Enlargement of the mesh's bounding sphere, for a border and for rounding."""
SCENE_DIGITS = 3
"""Decimals of the numbers that are written to the scene, relative to the power of ten above its radius."""
FROM_VIEWER = (1.0, 1.0, 2.0)
"""The camera stands in front, to the right and above: three sides of a box are seen."""
FROM_LIGHT = (-1.0, 3.0, 2.0)
"""The light comes from above, over the viewer's left shoulder, so that shadows fall to the right."""
LIGHT_DISTANCE = 3.0
"""In radii of the mesh. The light is as wide as one radius: a soft shadow."""


def bounding_sphere(vertices: Floats) -> tuple[Floats, float]:
    """Middle (3,) of the bounding box of vertices (N, 3), and half its diagonal; 1 where that is 0."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low)) / 2 or 1.0


def default_camera(middle: Floats, radius: float) -> dict[str, Any]:
    """A camera that sees the whole sphere, y upwards."""
    distance = SPHERE_MARGIN * radius / math.sin(math.radians(FIELD_OF_VIEW / 2))
    direction = np.array(FROM_VIEWER) / np.linalg.norm(FROM_VIEWER)
    return {
        "position": _rounded(middle + distance * direction, radius),
        "look_at": _rounded(middle, radius),
        "up": [0, 1, 0],
        "vertical_fov": FIELD_OF_VIEW,
        "width": PICTURE_SIZE,
        "height": PICTURE_SIZE,
    }


def default_light(middle: Floats, radius: float) -> dict[str, Any]:
    """A square light that the camera does not see."""
    direction = np.array(FROM_LIGHT) / np.linalg.norm(FROM_LIGHT)
    side = _rounded(np.array([radius]), radius)[0]
    return {
        "type": "rectangle",
        "center": _rounded(middle + LIGHT_DISTANCE * radius * direction, radius),
        "normal": [-number for number in FROM_LIGHT],
        "tangent": [1, 0, 0],
        "size": [side, side],
        "color": [0.9, 0.9, 0.9],
        "visible": False,
    }


def _rounded(numbers: Floats, radius: float) -> list[float]:
    decimals = SCENE_DIGITS - math.floor(math.log10(radius))
    return [round(float(number), decimals) for number in numbers]


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
        Collects assumptions.
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
        task.notes.assume("", "The camera shows all of the mesh from the front, right and above; y is up.")
        camera = default_camera(middle, radius)
    scene["camera"] = camera
    if not lights:
        task.notes.assume(
            "", "A square light from above left, and ambient light of 1: materials reflect a tenth of it."
        )
        scene["ambient"] = [1, 1, 1]
        lights = [default_light(middle, radius)]
    if textures:
        scene["textures"] = textures
    return scene | {"materials": materials, "shapes": shapes, "lights": lights}


def convert_ply(task: Task) -> dict[str, Any]:
    """The scene of a PLY file, with a camera that sees all of it, and a light.

    It is grey, or has the picture that a comment `TextureFile` names.

    Raises
    ------
    ConversionError
        The renderer could not read it.
    """
    try:
        vertices, _, coordinates = read_mesh(task.path.name, One(task.content))
        pictures = header_of(task.content).pictures
    except AssetError as error:
        raise wrong_at(task.path.name, "", str(error)) from error
    picture = _picture_of(task, pictures, is_textured=coordinates is not None)
    asset = task.placed.keep(task.path.resolve(), task.content)
    if picture is None:
        task.notes.assume("", f"The mesh is grey, {DEFAULT_GREY}: colours of its vertices are not read.")
        textures, name = {}, "grey"
        color: dict[str, Any] = {"color": [DEFAULT_GREY] * 3}
    else:
        texture = {"type": "image", "asset": picture, "encoding": "srgb", "wrap": "repeat"}
        textures, name, color = {"picture": texture}, "textured", {"color_texture": "picture"}
    return scene_around(
        task,
        vertices.T,
        textures=textures,
        materials={name: {"type": "phong"} | color},
        shapes=[{"type": "mesh", "name": task.path.stem, "asset": asset, "material": name}],
    )


def _picture_of(task: Task, pictures: Sequence[str], *, is_textured: bool) -> str | None:
    """The scene's name of the picture on a PLY mesh; None, with a note, where it cannot be used."""
    used = None
    for number, name in enumerate(pictures):
        place = f"TextureFile {name}"
        if number:
            detail = "The picture is left out: a mesh has one material, which shows the first picture."
            task.notes.leave_out(place, detail)
        elif not is_textured:
            detail = "The picture is left out: the mesh has no texture coordinates. Save it with them."
            task.notes.leave_out(place, detail)
        else:
            try:
                used = picture_file(task, task.folder, name)
            except UNUSABLE_FILE_ERRORS as error:
                task.notes.leave_out(place, f"The picture is left out. {error}")
    return used
