"""How many light points a camera sample of target quality takes."""

from typing import Any

import pytest

import renderer
from schemas.quality import TargetQuality

LAMP = {
    "type": "rectangle",
    "center": [0, 4, 0],
    "normal": [0, -1, 0],
    "tangent": [1, 0, 0],
    "size": [1, 1],
    "color": [1, 1, 1],
}
FLOOR = {
    "type": "rectangle",
    "center": [0, 0, 0],
    "normal": [0, 1, 0],
    "tangent": [1, 0, 0],
    "size": [4, 4],
    "material": "floor",
}
PYRAMID = {
    "type": "mesh",
    "vertices": [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]],
    "triangles": [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    "material": "floor",
}
BOARD = {"board": {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [4, 4]}}


def light_points(*shapes: dict[str, Any], floor: dict[str, Any], lens_radius: float = 0.0) -> int:
    scene = {
        "version": 1,
        "camera": {
            "position": [0, 2, 8],
            "look_at": [0, 1, 0],
            "up": [0, 1, 0],
            "vertical_fov": 40,
            "lens_radius": lens_radius,
            "width": 8,
            "height": 8,
        },
        "textures": BOARD if "color_texture" in floor else {},
        "materials": {"floor": {"type": "phong", **floor}},
        "shapes": [FLOOR, *shapes],
        "lights": [LAMP],
    }
    return renderer.compile_scene(scene, TargetQuality(mode="target", error=0.01)).light_points


@pytest.mark.parametrize(
    "floor", [{"color": [1, 1, 1]}, {"color_texture": "board"}], ids=["plain", "checker"]
)
def test_penumbrae_get_many_light_points_where_little_else_is_sampled(floor: dict[str, Any]) -> None:
    assert light_points(floor=floor) == 16


def test_scenes_whose_pixels_are_all_sampled_get_few() -> None:
    plain = {"color": [1, 1, 1]}
    assert light_points(floor=plain | {"mirror": 0.5}) == 4
    assert light_points(floor=plain, lens_radius=0.1) == 4
    assert light_points(PYRAMID, floor=plain) == 4
