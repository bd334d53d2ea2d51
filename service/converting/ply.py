"""PLY meshes: shapes alone, without materials."""

from __future__ import annotations

from typing import Any

from renderer.assets import AssetError
from renderer.meshes.files import read_mesh
from service.converting.assets import One
from service.converting.errors import wrong_at
from service.converting.meshes import scene_around
from service.converting.mtl_materials import GREY
from service.converting.task import Task


def convert_ply(task: Task) -> dict[str, Any]:
    """The scene of a PLY file: grey, with a camera that sees all of it, and a light.

    Raises
    ------
    ConversionError
        The renderer could not read it.
    """
    try:
        vertices = read_mesh(task.path.name, One(task.content))[0].T
    except AssetError as error:
        raise wrong_at(task.path.name, "", str(error)) from error
    task.notes.assume("", f"The mesh is grey, {GREY}: colours of its vertices are not read.")
    asset = task.placed.keep(task.path.resolve(), task.content)
    return scene_around(
        task,
        vertices,
        textures={},
        materials={"grey": {"type": "phong", "color": [GREY] * 3}},
        shapes=[{"type": "mesh", "name": task.path.stem, "asset": asset, "material": "grey"}],
    )
