"""Scenes without the content of their meshes: enough to check and price them where nothing is rendered.

A mesh file is parsed in a worker, never here. What it announces of itself is looked at.
"""

from __future__ import annotations

import renderer
from renderer.assets import AssetError
from renderer.shapes.mesh_files import announced, content_of
from schemas.problems import Problem
from schemas.scene import Scene
from schemas.shapes import Mesh, MeshFile

_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_MANY = 1024
"""Triangles that stand for a mesh: priced within a factor of two of a million of them."""


def outlined(scene: Scene, assets: renderer.AssetSource) -> Scene:
    """Give the scene with a few triangles in place of each mesh.

    Raises
    ------
    renderer.SceneError
        With every file that is missing, no mesh, or announces too much; pointers start at the scene.
    """
    problems = [
        Problem(pointer=f"/shapes/{number}/asset", detail=detail, code="asset")
        for number, shape in enumerate(scene.shapes)
        if isinstance(shape, MeshFile) and (detail := _problem(shape.asset, assets))
    ]
    if problems:
        raise renderer.SceneError(problems)
    shapes = tuple(
        _stand_in(shape) if isinstance(shape, Mesh | MeshFile) else shape for shape in scene.shapes
    )
    return scene.model_copy(update={"shapes": shapes})


def _problem(name: str, assets: renderer.AssetSource) -> str | None:
    try:
        announced(content_of(name, assets))
    except AssetError as error:
        return str(error)
    return None


def _stand_in(shape: Mesh | MeshFile) -> Mesh:
    triangles = ((0, 1, 2),) * _MANY
    return Mesh(
        type="mesh", vertices=_CORNERS, triangles=triangles, smooth=shape.smooth, material=shape.material
    )
