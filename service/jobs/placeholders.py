"""Scenes without the content of their files: enough to check and price them where nothing is rendered.

Pictures are decoded and meshes are parsed in workers, which have a limit of memory and may die, never here.
What kind of file each is was found out when it was uploaded. A plan and its price are the same with them.
"""

from __future__ import annotations

import base64

from schemas.limits import Limits
from schemas.scene import Scene
from schemas.shapes import Mesh, MeshFile, Shape

_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_MANY = 1024
"""Triangles that stand for a mesh: priced within a factor of two of a million of them."""
_MOST = 200_000
"""Triangles that stand for all meshes of a scene together."""
_PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC"
)


class Pixels:
    """One white pixel in place of each picture. Satisfies ``renderer.AssetSource``.

    What stands for the user's files is bounded here, so that no setting refuses it.
    """

    limits = Limits()

    def read(self, name: str) -> bytes:  # noqa: ARG002  (an interface)
        """Give the pixel, as a PNG file."""
        return _PIXEL


def outlined(scene: Scene) -> Scene:
    """Give the scene with a few triangles in place of each mesh."""
    count = sum(_is_mesh(shape) for shape in scene.shapes)
    if not count:
        return scene
    triangles = ((0, 1, 2),) * min(_MANY, max(1, _MOST // count))
    shapes = tuple(_stand_in(shape, triangles) for shape in scene.shapes)
    return scene.model_copy(update={"shapes": shapes})


def _is_mesh(shape: Shape) -> bool:
    return isinstance(shape, Mesh | MeshFile)


def _stand_in(shape: Shape, triangles: tuple[tuple[int, int, int], ...]) -> Shape:
    if not isinstance(shape, Mesh | MeshFile):
        return shape
    return Mesh(
        type="mesh", vertices=_CORNERS, triangles=triangles, smooth=shape.smooth, material=shape.material
    )
