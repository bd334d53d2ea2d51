"""A scene with a number in every field that takes one, and the same with one place changed."""

import copy
import json
from collections.abc import Iterator
from typing import Any

from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    scene,
    sphere,
    sun,
    triangle,
)
from schemas.errors import SceneError
from schemas.pointers import Parts
from schemas.reading import read_scene


def everything() -> Json:
    """A scene with a number in every field that takes one."""
    card = {"center": [1, 1, 1], "normal": [0, 0, 1], "tangent": [1, 0, 0], "size": [2, 1]}
    corners: list[list[float]] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    flat = {"vertices": corners, "triangles": [[0, 1, 2]], "uvs": [[0, 0], [1, 0], [0, 1]]}
    turned = {"scale": [1, 2, 3], "rotate": {"axis": [0, 1, 0], "degrees": 30}, "translate": [1, 2, 3]}
    strengths = {"specular": 0.1, "shininess": 9, "bump_height": 1, "displacement_height": 1}
    strengths |= {"mirror": 0.1, "transmission": 0.1, "ior": 1.5, "max_depth": 3}
    written = scene(
        triangle(*corners, normals=[[0, 0, 1]] * 3, uvs=[[0, 0], [1, 0], [0, 1]]),
        {"type": "rectangle", **card, "material": "plain"},
        rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]),
        ellipsoid([0, 1, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]),
        sphere([0, 1, 0], 1),
        {"type": "mesh", **flat, **turned, "material": "plain"},
        lights=[
            {"type": "rectangle", **card, "color": [1, 1, 1]},
            lamp([0, 5, 0], [1, 0, 0], [0, 0, 1]),
            bulb([0, 6, 0]),
            sun([0, -1, 0]),
        ],
        camera=camera(up=[0, 1, 0], focal_length=1, lens_radius=0.1, focus_distance=5),
        materials={"plain": {**phong(), **strengths}},
        textures={"board": {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [8, 8]}},
        display={"transfer": "srgb", "exposure": 0},
    )
    # Written and read again, no two fields share a list.
    read: Json = json.loads(json.dumps(written))
    return read


def numbers_in(node: Any, parts: Parts = ()) -> Iterator[Parts]:
    """Where the numbers of a document stand."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield from numbers_in(value, (*parts, key))
    if isinstance(node, int | float):
        yield parts


def changed(document: Json, parts: Parts, value: object) -> Json:
    """A copy with another value in one place."""
    other = copy.deepcopy(document)
    node: Any = other
    for part in parts[:-1]:
        node = node[part]
    node[parts[-1]] = value
    return other


def refused_at(source: Json | bytes, place: str) -> bool:
    """Whether a scene is refused, and each problem is told at this place."""
    try:
        read_scene(source)
    except SceneError as error:
        return all(problem.pointer == place for problem in error.errors)
    return False


def vectors_in(node: Any, parts: Parts = ()) -> Iterator[Parts]:
    """Where the directions and edges of a document stand."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        if key in {"up", "normal", "tangent", "direction", "axis"}:
            yield (*parts, key)
        elif key in {"edges", "axes", "normals"}:
            yield from ((*parts, key, i) for i in range(len(value)))
        else:
            yield from vectors_in(value, (*parts, key))
