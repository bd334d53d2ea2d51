"""Small scenes that together use every kind of shape, light, texture and bounce."""

import io
from typing import Any

import numpy as np
from PIL import Image

import renderer
from accuracy.hard_cases import solids
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from schemas.quality import FixedQuality

SINGLE = FixedQuality(mode="fixed", precision="single")
DOUBLE = FixedQuality(mode="fixed", precision="double")


class Files(dict[str, bytes]):
    """Files in memory, as an asset source."""

    def read(self, name: str) -> bytes:
        """Content of a file; raises KeyError if there is none of that name."""
        return self[name]


def waves_of_color(means: tuple[float, float, float], depth: float) -> bytes:
    """A PNG file whose colours change slowly, so that no texel is an edge."""
    y, x = np.mgrid[:12, :16] / 16
    channels = [
        mean + depth * np.sin(6 * x + shift) * np.cos(5 * y - shift) for shift, mean in enumerate(means)
    ]
    buffer = io.BytesIO()
    Image.fromarray(np.round(255 * np.stack(channels, axis=2)).astype(np.uint8)).save(buffer, format="PNG")
    return buffer.getvalue()


FILES = Files(
    {
        "waves.png": waves_of_color((0.5, 0.5, 0.5), 0.3),
        "normals.png": waves_of_color((0.5, 0.5, 0.9), 0.1),
    }
)
WAVES = {
    name: {"type": "image", "asset": f"{name}.png", "encoding": "linear", "wrap": "repeat"}
    for name in ("waves", "normals")
}
BOARD = {"board": {"type": "checker", "repeat": [9, 9], "filter": "box"}}
FLOOR = rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])
CEILING_LAMP = lamp([-0.5, 3.9, -0.5], [1, 0, 0], [0, 0.1, 1])
VIEW = camera(width=48, height=32)


def every_shape() -> Json:
    """All kinds of shapes, lit by a lamp of 3 x 3 points; a picture on some of them."""
    materials = {
        "plain": phong(),
        "shiny": phong([0.3, 0.5, 0.7], specular=0.6, shininess=20),
        "picture": phong(color_texture="waves"),
    }
    return scene(
        FLOOR,
        rectangle([-2, 0, -2], [4, 0.3, 0], [0, 4, 0.2], material="picture"),
        sphere([-0.9, 0.6, -0.3], 0.6, material="shiny"),
        ellipsoid([0.7, 1.1, 0.2], [0.5, 0.25, 0], [-0.2, 0.4, 0], [0, 0, 0.3], material="picture"),
        triangle([-1.2, 1.9, -0.9], [0.1, 2.6, -0.7], [-0.6, 1.4, 0.6], material="shiny"),
        {
            "type": "rectangle",
            "center": [0.9, 2.2, -1.1],
            "normal": [-0.4, 1, 0.5],
            "tangent": [1, 0.3, 0],
            "size": [1.1, 0.7],
            "material": "plain",
        },
        camera=VIEW,
        lights=[
            CEILING_LAMP,
            lamp([-1.8, 1, 0.5], [0, 0.9, 0], [0, 0.1, 0.8], (0.2, 0.5, 0.3), two_sided=False),
        ],
        materials=materials,
        textures={"waves": WAVES["waves"]},
        sampling=sampled(4, 9),
    )


def mesh_on_a_board() -> Json:
    """A smooth mesh of many triangles on a checker board, by a bulb, the sun, and Sobol points of a lamp."""
    vertices, faces = solids.outward([0.2, 1.2, 0.1], 1.0, 2)
    ball = {
        "type": "mesh",
        "vertices": vertices.tolist(),
        "triangles": faces.tolist(),
        "material": "shiny",
        "smooth": True,
    }
    materials = {
        "plain": phong(color_texture="board"),
        "shiny": phong([0.3, 0.5, 0.7], specular=0.4, shininess=300),
    }
    return scene(
        {**FLOOR},
        ball,
        camera=VIEW,
        lights=[CEILING_LAMP, bulb([2.2, 2.1, 1.4]), sun([0.3, -1, -0.6])],
        materials=materials,
        textures=BOARD,
        sampling=sampled(1, 9, light="sobol", seed=3),
    )


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
        camera=VIEW,
        lights=[{**CEILING_LAMP, "falloff": "physical", "color": [14, 12, 11]}],
        materials=materials,
        sampling=sampled(1, 9, light="stratified", seed=5),
    )


def carved_and_blurred() -> Json:
    """Bump, normal and displacement maps before a camera with a lens."""
    materials = {
        "plain": phong(bump_map="waves", bump_height=0.05),
        "raised": phong([0.3, 0.7, 0.5], displacement_map="waves", displacement_height=0.3),
        "bent": phong([0.7, 0.5, 0.3], normal_map="normals", specular=0.3),
    }
    view = camera(width=48, height=32, lens_radius=0.05, focus_distance=6)
    return scene(
        FLOOR,
        rectangle([-1.8, 0.3, -0.5], [1.7, 0, 0.2], [0.1, 1.8, 0], material="raised"),
        ellipsoid([0.9, 1.1, 0.2], [0.8, 0.1, 0], [-0.1, 0.8, 0], [0, 0, 0.9], material="bent"),
        camera=view,
        lights=[CEILING_LAMP],
        materials=materials,
        textures=WAVES,
        sampling=sampled(4, 4, "random", "random", seed=9),
    )


def ball_on_a_floor() -> Json:
    """The least that has an outline and a shadow; a bulb makes it hard."""
    return scene(FLOOR, sphere([0.2, 1.1, 0.3], 0.8), camera=VIEW, lights=[bulb([1.3, 3.2, 0.9])])


SCENES = {
    "ball on a floor": ball_on_a_floor,
    "every shape": every_shape,
    "mesh on a board": mesh_on_a_board,
    "mirror and glass": mirror_and_glass,
    "carved and blurred": carved_and_blurred,
}


def plan_of(document: Json, quality: FixedQuality | None = None) -> renderer.RenderPlan:
    """The plan of a scene with the files above."""
    return renderer.compile_scene(renderer.load_scene(document, assets=FILES), quality)


def image_of(document: Json, quality: FixedQuality | None = None, **options: Any) -> Any:
    """Its picture, (H, W, 3) float32."""
    return renderer.render(plan_of(document, quality), **options).image
