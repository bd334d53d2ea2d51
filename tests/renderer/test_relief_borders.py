"""Displaced shapes side by side: which of them are joined, and where."""

from typing import Any

import numpy as np

import schemas.textures as language
from accuracy.hard_cases.documents import Json, mesh, rectangle
from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene
from tests.numerics.relief import hills, open_edges, relief_scene
from tests.pictures.parts import Files, png

LEFT, RIGHT = (rectangle([x, -1, 0], [2, 0, 0], [0, 2, 0]) for x in (-2, 0))


def heights(scale: float = 0.3) -> Heights:
    texture = language.ImageTexture.model_validate({"type": "image", "asset": "map", "encoding": "linear"})
    return Heights(image.build(texture, Files({"map": png(hills())})), scale)


def built(shapes: list[Json], reliefs: list[Heights] | None = None) -> list[Floats]:
    """Corners (3, 3, T) of the fine triangles of each shape; one relief for all unless there are more."""
    read = read_scene({**relief_scene(shapes[0], 30, 0.3), "shapes": shapes})[0]
    given: list[Any] = reliefs or [heights()] * len(shapes)
    parts = [Displaced(i, shape, given[i]) for i, shape in enumerate(read.shapes)]
    family = displacement.build(parts, build_pinhole(read.camera), Files())
    return [family.vertices[:, :, family.numbers == i] for i in range(len(shapes))]


def on_seam(corners: Floats) -> Floats:
    """Places (N, 3) with x = 0, each once, from below."""
    places = corners.transpose(0, 2, 1).reshape(-1, 3)
    return np.unique(places[places[:, 0] == 0], axis=0)


def test_tiles_join_at_mean_heights() -> None:
    """The hills do not repeat: alone, the tiles end at other heights."""
    left, right = (on_seam(part) for part in built([LEFT, RIGHT]))
    np.testing.assert_array_equal(left, right)
    alone = [on_seam(built([tile])[0]) for tile in (LEFT, RIGHT)]
    np.testing.assert_allclose(left, (alone[0] + alone[1]) / 2, rtol=0, atol=2.0**-50)
    assert np.abs(alone[0] - alone[1]).max() > 0.01


def test_other_reliefs_are_not_joined() -> None:
    parts = built([LEFT, RIGHT], [heights(0.3), heights(0.2)])
    for part, tile, relief in zip(parts, (LEFT, RIGHT), (heights(0.3), heights(0.2)), strict=True):
        np.testing.assert_array_equal(part, built([tile], [relief])[0])


def test_faces_of_a_plate_join_at_the_rim() -> None:
    front = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0])
    back = rectangle([-1, -1, 0], [0, 2, 0], [2, 0, 0])
    for side, corners in zip((1, -1), built([front, back]), strict=True):
        rim = np.abs(corners[:, :2]).max(axis=1) == 1
        assert (corners[:, 2][rim] == 0).all()
        assert (side * corners[:, 2][~rim] > 0).all()


def test_mesh_and_rectangle_join() -> None:
    """Both together end where their outline is: at six sides of a square."""
    square = mesh([[0, -1, 0], [2, -1, 0], [2, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    square["uvs"] = [[0, 0], [1, 0], [1, 1], [0, 1]]
    left, right = built([LEFT, square])
    np.testing.assert_array_equal(on_seam(left), on_seam(right))
    _, open_ = open_edges(np.concatenate((left, right), axis=2))
    cuts = len(on_seam(left)) - 1
    assert open_ == 6 * cuts
