"""Shading points and texture look-ups are counted exactly, and are zero where nothing needs them."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import Json, phong, rectangle, sampled, scene, sphere, sun
from tests.pictures.parts import Files, png

WALL = rectangle([-9, -9, 0], [18, 0, 0], [0, 18, 0])
LEFT, RIGHT = (rectangle([x, -9, 0], [9, 0, 0], [0, 18, 0]) for x in (-9, 0))
VIEW = {"position": [0, 0, 5], "look_at": [0, 0, 0], "width": 8, "height": 6, "vertical_fov": 30}
PIXELS = 8 * 6
TEXTURES = {
    "picture": {"type": "image", "asset": "grey.png", "filter": "mipmap"},
    "board": {"type": "checker"},
    "bumps": {"type": "image", "asset": "grey.png", "encoding": "linear"},
}
FILES = Files({"grey.png": png(np.full((4, 4, 3), 200, dtype=np.uint8))})


def work(*shapes: Json, layers: tuple[str, ...] = (), **changes: Any) -> tuple[int, int]:
    """Shading points and texture look-ups of a picture of 8 x 6 pixels."""
    options = {"camera": VIEW, "lights": [sun([0, 0, -1])], "textures": TEXTURES, "sampling": sampled(4)}
    loaded = renderer.load_scene(scene(*shapes, **(options | changes)), assets=FILES)
    counted = renderer.render(renderer.compile_scene(loaded, layers=layers), tile_size=5).report["work"]
    assert set(counted) == {"shading_points", "texture_lookups"}
    return counted["shading_points"], counted["texture_lookups"]


def of(**material: Any) -> Json:
    return {"plain": phong(**material)}


def test_misses_count_nothing() -> None:
    assert work(sphere([0, 0, 90], 1)) == (0, 0)


def test_wall_is_shaded_once_a_sample() -> None:
    assert work(WALL) == (4 * PIXELS, 0)
    assert work(WALL, sampling=sampled(9)) == (9 * PIXELS, 0)


@pytest.mark.parametrize(
    ("material", "lookups"),
    [
        ({"color_texture": "board"}, 1),
        ({"color_texture": "picture"}, 1),
        ({"normal_map": "picture"}, 1),
        ({"bump_map": "bumps", "bump_height": 0.1}, 4),
        ({"bump_map": "bumps", "bump_height": 0.0}, 0),
        ({"color_texture": "board", "normal_map": "picture", "bump_map": "bumps", "bump_height": 0.1}, 6),
    ],
    ids=str,
)
def test_texture_look_ups(material: Json, lookups: int) -> None:
    assert work(WALL, materials=of(**material)) == (4 * PIXELS, lookups * 4 * PIXELS)


def test_mirrored_points_are_shaded() -> None:
    """A mirror fills the picture, and shows a wall far behind the camera that has no end to speak of."""
    behind = rectangle([-900, -900, 50], [1800, 0, 0], [0, 1800, 0], material="painted")
    materials = of(mirror=0.5) | {"painted": phong(color_texture="board")}
    assert work(WALL, behind, materials=materials) == (8 * PIXELS, 4 * PIXELS)


def test_layers_are_counted() -> None:
    materials = of(color_texture="board")
    assert work(WALL, materials=materials, layers=("albedo",)) == (5 * PIXELS, 5 * PIXELS)
    assert work(WALL, materials=materials, layers=("samples",)) == (4 * PIXELS, 4 * PIXELS)
