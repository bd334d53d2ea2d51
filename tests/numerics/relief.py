"""Surfaces displaced by a height map, their fine triangles, and solids to displace."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

import schemas.textures as language
from renderer.cameras import build_pinhole
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.shapes.triangles import Triangles
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene
from tests.documents import Json, camera, dark_scene, ellipsoid, mesh, phong, sphere, sun
from tests.pictures.parts import Files, png
from tests.solids import outward

Floats = np.ndarray
TEXELS = 64
WHITE = 65535


def hills() -> Floats:
    """Heights (64, 64) that do not repeat, so that no two edges of an image fit."""
    u, v = np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)
    return (WHITE * (0.5 + 0.25 * np.sin(7 * u + 5 * v) + 0.25 * np.cos(9 * u * v))).astype(np.uint16)


def relief_scene(shape: Json, size: int, height: float, **changes: Any) -> Json:
    """A shape moved by the file `map`, before a camera of size x size pixels."""
    view = camera(position=[0.4, 0.7, 6], look_at=[0, 0, 0], vertical_fov=40, width=size, height=size)
    moved = {"displacement_map": "map", "displacement_height": height} if height else {}
    return dark_scene(
        shape,
        camera=view,
        lights=[sun([0.2, -0.1, -1], [1, 1, 1])],
        textures={"map": {"type": "image", "asset": "map", "encoding": "linear"}},
        materials={"plain": phong([1, 1, 1], ambient=0.0, diffuse=1.0, **moved)},
        **changes,
    )


def fine_mesh(document: Json, heights: Floats, scale: float, group: Sequence[int] = (0,)) -> Triangles:
    """The fine triangles of shapes of a scene that are built together, moved by heights of a scale."""
    read = read_scene(document)[0]
    texture = language.ImageTexture.model_validate({"type": "image", "asset": "map", "encoding": "linear"})
    map_ = Heights(image.build(texture, Files({"map": png(heights)})), scale)
    moved = [Displaced(number, read.shapes[number], map_) for number in group]
    return displacement.build(moved, build_pinhole(read.camera), Files())


def cube() -> Json:
    """A cube whose faces share no vertex, each with the whole texture."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            corners = np.insert(square[:: int(side)], 0, side, axis=1)
            faces += [[len(vertices) + k for k in face] for face in ([0, 1, 2], [0, 2, 3])]
            vertices += np.roll(corners, axis, axis=1).tolist()
    return mesh(vertices, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]] * 6)


def closed_shapes() -> list[Json]:
    """Solids whose faces meet with different normals, texture coordinates, or both."""
    return [
        cube(),
        mesh(*outward([0, 0, 0], 1, 1)),
        mesh(*outward([0, 0, 0], 1, 0), smooth=True),
        sphere([0, 0, 0], 1),
        ellipsoid([0, 0, 0], [1.2, 0, 0], [0, 0.7, 0], [0, 0, 0.9]),
    ]


def open_edges(corners: Floats) -> tuple[int, int]:
    """Edges of triangles (3, 3, T), and how many of them do not have just one neighbour the other way round.

    Triangles with two corners in one place, as at a pole, are none.
    """
    places = np.unique(corners.transpose(0, 2, 1).reshape(-1, 3), axis=0, return_inverse=True)[1]
    numbers = places.reshape(3, -1)
    numbers = numbers[:, (numbers != numbers[[1, 2, 0]]).all(axis=0)]
    edges: Counter[tuple[int, int]] = Counter()
    for start, end in ((0, 1), (1, 2), (2, 0)):
        edges.update(zip(numbers[start].tolist(), numbers[end].tolist(), strict=True))
    return len(edges), sum(not count == edges[b, a] == 1 for (a, b), count in edges.items())
