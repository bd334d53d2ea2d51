"""A rectangle means the same by its centre and by its corner, as a shape and as a light."""

import numpy as np

from accuracy.hard_cases.documents import Json, lamp, phong, rectangle, room, sampled, scene
from tests.pictures.parts import image_of

BY_CORNER = lamp([-0.5, 3.75, -0.25], [1, 0, 0], [0, 0, 0.5], two_sided=False)
BY_CENTER = {
    "type": "rectangle",
    "center": [0, 3.75, 0],
    "normal": [0, -1, 0],
    "tangent": [1, 0, 0],
    "size": [1, 0.5],
    "color": BY_CORNER["color"],
    "two_sided": False,
}
TABLE = {
    "type": "rectangle",
    "center": [0.25, 1, 0.5],
    "normal": [0, 2, 0],
    "tangent": [0, 0.5, 4],
    "size": [1, 1.5],
    "material": "board",
}
CHECKERED: Json = {
    "textures": {
        "squares": {"type": "checker", "even": [0.9, 0.9, 0.1], "odd": [0, 0, 0.2], "repeat": [2, 3]}
    },
    "materials": {"plain": phong(), "board": phong(color_texture="squares")},
}


def test_light_by_centre_or_corner() -> None:
    images = [
        image_of(scene(*room(), lights=[light], sampling=sampled(points=4)))
        for light in (BY_CENTER, BY_CORNER)
    ]
    assert np.array_equal(*images)
    assert images[0].std() > 0


def test_rectangle_by_centre_or_corner() -> None:
    """Its tangent, made perpendicular to the normal, is z; normal x tangent is x."""
    by_corner = rectangle([-0.5, 1, 0], [0, 0, 1], [1.5, 0, 0], material="board")
    images = [
        image_of(scene(*room(), table, lights=[BY_CORNER], **CHECKERED)) for table in (TABLE, by_corner)
    ]
    assert np.array_equal(*images)
    without = image_of(scene(*room(), lights=[BY_CORNER], **CHECKERED))
    assert not np.array_equal(images[0], without)
