"""Small scenes that together use every part of the scene language, for tests of whole pictures."""

import random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    room,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)

CEILING_LAMP = lamp([-0.5, 3.9, -0.5], [1, 0, 0], [0, 0, 1])
FLOOR = rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])


def furnished() -> list[Json]:
    """A room with every kind of shape in it."""
    return [
        *room(),
        sphere([-0.9, 0.6, -0.3], 0.6, material="shiny"),
        ellipsoid([0.7, 1.1, 0.2], [0.5, 0.25, 0], [-0.2, 0.4, 0], [0, 0, 0.3]),
        triangle([-1.2, 1.9, -0.9], [0.1, 2.6, -0.7], [-0.6, 1.4, 0.6]),
        {
            "type": "rectangle",
            "center": [0.9, 2.2, -1.1],
            "normal": [-0.4, 1, 0.5],
            "tangent": [1, 0.3, 0],
            "size": [1.1, 0.7],
            "material": "plain",
        },
    ]


SHINY = {"plain": phong(), "shiny": phong([0.3, 0.5, 0.7], specular=0.6, shininess=20)}


def of_room(**changes: Any) -> Json:
    base = {"materials": SHINY, "lights": [CEILING_LAMP], "sampling": sampled(4, 9)}
    return scene(*furnished(), **{**base, **changes})


def skew() -> Json:
    """Parallelograms far from square, lit by one."""
    return scene(
        FLOOR,
        rectangle([-1, 0.8, -1], [1.7, 0.3, 0.2], [1.2, 0.1, 1.4]),
        rectangle([1.2, 0.1, -1.5], [0.4, 2, 0.3], [-0.8, 1.5, 0.1], material="shiny"),
        lights=[lamp([-0.7, 3.1, -0.4], [1.3, 0.2, 0.1], [0.9, 0.4, 0.8])],
        materials=SHINY,
        sampling=sampled(4, 9),
    )


def many_lights() -> Json:
    """Two rectangles, a bulb and the sun."""
    lights = [
        CEILING_LAMP,
        lamp([-1.8, 1, 0.5], [0, 0.9, 0], [0, 0.1, 0.8], (0.2, 0.5, 0.3)),
        bulb([1.3, 3.2, 0.9]),
        sun([0.3, -1, -0.6]),
    ]
    return of_room(lights=lights, sampling=sampled(1, 9))


def one_sided() -> Json:
    """A lamp between floor and ball that shines upwards only."""
    light = lamp([-0.6, 1.1, -0.4], [0, 0, 1], [1.1, 0, 0], two_sided=False, visible=False)
    return scene(
        FLOOR,
        sphere([0.2, 2.3, 0.1], 0.7, material="shiny"),
        camera=camera(position=[0.3, 0.7, 5.1], look_at=[0.1, 1.8, 0]),
        lights=[light],
        materials=SHINY,
        sampling=sampled(4, 9),
    )


def lamp_in_ball(radius: float, position: list[float]) -> Json:
    return scene(
        FLOOR,
        sphere([0.2, 1.5, 0.1], radius),
        lights=[bulb(position), lamp([-0.1, 1.2, 0], [0.4, 0, 0], [0, 0.1, 0.4], visible=False)],
        sampling=sampled(1, 9),
    )


def inside_a_ball(*others: Json, lights: list[Json]) -> Json:
    """The camera in an ellipsoid."""
    around = ellipsoid([0.2, 1.5, 2], [5, 0, 0], [0, 6, 0], [0, 0, 7], material="shiny")
    return scene(around, *others, lights=lights, materials=SHINY, sampling=sampled(1, 9))


def gloss(shininess: float) -> Json:
    """The mirror image of a lamp in a floor and on a ball, seen from near."""
    return scene(
        FLOOR,
        sphere([0.9, 0.5, -1], 0.7),
        camera=camera(position=[0, 2, 5], look_at=[0.15, 0, -1], vertical_fov=14, width=24, height=16),
        lights=[lamp([-0.2, 1.6, -6], [0.7, 0, 0], [0, 0.5, 0.2], visible=False)],
        materials={"plain": phong(specular=0.5, shininess=shininess)},
        sampling=sampled(4, 9),
    )


def smooth() -> Json:
    """A faceted dome with the normals of a ball; the lamp also reaches below the facets' horizons."""
    ring = [[1.5 * np.cos(a), 0.4, 1.5 * np.sin(a)] for a in np.linspace(0.1, 6.3831853, 7)[:-1]]
    top = [0.1, 1.9, 0.0]
    shapes = [
        triangle(top, [*map(float, b)], [*map(float, a)], normals=[_outward(x) for x in (top, b, a)])
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True)
    ]
    for shape in shapes:
        shape["material"] = "shiny"
    return scene(
        FLOOR,
        *shapes,
        lights=[lamp([-3, 1.2, 0.4], [1.9, 0.4, 0], [0, 1.5, 1.3]), bulb([2.2, 1.1, 1.4])],
        materials={"plain": phong(), "shiny": phong(specular=0.5)},
        sampling=sampled(4, 9),
    )


def _outward(vertex: Any) -> list[float]:
    return [float(vertex[0]), float(vertex[1]), float(vertex[2])]


def codes(height: int, width: int, seed: int = 1) -> NDArray[np.uint8]:
    """A picture of seeded noise."""
    chosen = random.Random(seed)
    return np.array(
        [[[chosen.randrange(256) for _ in "rgb"] for _ in range(width)] for _ in range(height)], np.uint8
    )


def bumps(height: int = 5, width: int = 7) -> NDArray[np.uint8]:
    """A normal map: mostly outwards, one texel flat grey, one pointing inwards."""
    picture = codes(height, width, seed=4)
    picture[..., 2] = 150 + picture[..., 2] // 3
    picture[0, 0] = 128
    picture[1, 1] = (200, 90, 70)
    return picture


def textured(**texture: Any) -> Json:
    """A picture on every kind of shape, with coordinates beyond 0 to 1 on a triangle."""
    return scene(
        rectangle([-2.2, 0.2, 0], [2, 0.1, 0], [0.1, 2.4, 0]),
        triangle([0, 0, 0.4], [2.3, 0.3, 0], [0.4, 2.6, 0.2], uvs=[[-1.3, -0.4], [2.1, 0.2], [0.3, 1.9]]),
        sphere([-0.3, 2.5, 0.5], 0.7),
        lights=[bulb([1, 3, 5]), sun([0.2, -0.3, -1])],
        textures={"picture": {"type": "image", "asset": "picture.png", "encoding": "linear"} | texture},
        materials={"plain": phong(color_texture="picture")},
        sampling=sampled(4),
    )


def checkered() -> Json:
    board = {"type": "checker", "even": [0.9, 0.8, 0.7], "odd": [0.1, 0.2, 0.3], "repeat": [7.3, 4.1]}
    return {**textured(), "textures": {"picture": board}}


def carved(filter_: str = "bilinear") -> Json:
    """A normal map on a rectangle, a sphere seen from outside, flat and smooth triangles."""
    normals = [[-0.3, 0.1, 1], [0.4, 0, 1], [0, 0.5, 1]]
    relief = {
        "type": "image",
        "asset": "bumps.png",
        "encoding": "linear",
        "filter": filter_,
        "wrap": "repeat",
    }
    return scene(
        rectangle([-2.2, 0.2, 0], [2, 0.1, 0], [0.1, 2.4, 0]),
        triangle([0.1, 0, 0.4], [2.3, 0.3, 0], [0.4, 1.3, 0.2], uvs=[[0, 0], [2, 0.2], [0.3, 1.9]]),
        triangle(
            [0.5, 1.5, 0.4], [2.5, 1.4, 0], [0.9, 2.9, 0.2], uvs=[[0, 1], [0.1, 0], [1, 1]], normals=normals
        ),
        sphere([-0.5, 2.7, 0.5], 0.7),
        lights=[lamp([0.5, 2, 2], [1.2, 0, 0.3], [0, 1.4, 0.2], visible=False), sun([0.9, -0.2, -0.5])],
        textures={"bumps": relief},
        materials={"plain": phong(normal_map="bumps", specular=0.4, shininess=9)},
        sampling=sampled(4, 9),
    )


def lamp_in_ceiling() -> Json:
    """A visible lamp that lies in the ceiling."""
    lights = [lamp([-0.5, 4, -0.5], [1, 0, 0], [0, 0, 1])]
    high = camera(position=[0.3, 1, 6.1], look_at=[0.1, 2.6, 0])
    return of_room(lights=lights, camera=high)


def mirror_and_glass() -> Json:
    """A mirror, a ball of glass, and a glossy one with a bent mirror on it; physical falloff."""
    materials = {
        "plain": phong(),
        "mirror": phong([0.1, 0.1, 0.1], mirror=0.8),
        "glass": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5),
        "shiny": phong([0.7, 0.2, 0.2], specular=0.4, shininess=30, mirror=0.2),
    }
    return scene(
        FLOOR,
        rectangle([-2, 0.1, -1.7], [4, 0, 0.4], [0, 3, -0.2], material="mirror"),
        sphere([0.6, 1, 1.2], 0.7, material="glass"),
        ellipsoid([-1.1, 0.8, 0], [0.6, 0, 0.2], [0, 0.7, 0], [-0.2, 0, 0.6], material="shiny"),
        camera=camera(width=48, height=32),
        lights=[{**CEILING_LAMP, "falloff": "physical", "color": [14, 12, 11]}],
        materials=materials,
        sampling=sampled(1, 9, light="stratified", seed=5),
    )
