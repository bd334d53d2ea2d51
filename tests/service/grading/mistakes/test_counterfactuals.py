"""A wrong picture is diagnosed by reproducing likely mistakes with the reference scene."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import renderer
from accuracy.comparison import Comparison, Picture, Policy, compare, picture_of
from service.grading.mistakes.altered_textures import COLORS
from service.grading.mistakes.counterfactuals import explain
from tests.service.grading.assignments import npy

Document = dict[str, Any]

MATT = {"type": "phong", "ambient": 0.2, "diffuse": 0.8, "specular": 0.0, "shininess": 10}
CAMERA = {"position": [0.5, 2.5, 5], "look_at": [0, 0.5, 0], "up": [0.2, 1, 0], "vertical_fov": 45}
LAMP = {"type": "rectangle", "corner": [-3.5, 4, -1], "edges": [[3, 0, 0], [0, 0, 3]], "visible": False}
LIGHT = {"color": [0.7, 0.7, 0.7]}
SHINY = MATT | {"color": [0.5, 0.1, 0.1], "specular": 0.9, "shininess": 4}
BALL = {"type": "ellipsoid", "name": "ball", "center": [-0.8, 1.3, 0], "radius": 0.8, "material": "ball"}
FLOOR = {"type": "rectangle", "corner": [-4, 0, -4], "edges": [[0, 0, 8], [8, 0, 0]], "material": "floor"}
SAIL = {"type": "triangle", "vertices": [[0.6, 0.4, 0.4], [2, 0.4, 0], [1.2, 1.8, 1.2]], "material": "sail"}
MATERIALS = {
    "floor": MATT | {"color": [0.6, 0.6, 0.55]},
    "ball": SHINY,
    "sail": MATT | {"color": [0.1, 0.5, 0.2]},
}

SCENE: Document = {
    "version": 1,
    "camera": CAMERA | {"width": 64, "height": 48},
    "background": [0.1, 0.1, 0.2],
    "ambient": [1, 1, 1],
    "materials": MATERIALS,
    "shapes": [FLOOR, BALL, SAIL],
    "lights": [LAMP | LIGHT],
}
"""A glossy ball and a triangle, which leans away from the lamp, over a floor, seen by a tilted camera."""


def picture(document: Document, pattern: str = "random", light: str = "random", points: int = 4) -> Picture:
    sampling = {
        "antialiasing": {"pattern": pattern, "samples": 16},
        "light": {"pattern": light, "samples": points},
    }
    plan = renderer.compile_scene(document | {"sampling": sampling})
    return picture_of(npy(renderer.render(plan).image), "picture.npy")


@pytest.fixture(scope="module")
def reference() -> Picture:
    return picture(SCENE, "uniform", "uniform", 144)


def against(reference: Picture, image: Picture) -> Comparison:
    return compare(image, reference, policy=Policy(tolerance=0.005, most_bias=0.01))


def explained(reference: Picture, image: Picture, document: Document = SCENE) -> list[str]:
    found = explain(renderer.load_scene(document), against(reference, image))
    return [cause.cause for cause in found]


def lamp(**update: Any) -> Document:
    return SCENE | {"lights": [LAMP | LIGHT | update]}


def ball(**update: Any) -> Document:
    return SCENE | {"materials": MATERIALS | {"ball": SHINY | update}}


def camera(**update: Any) -> Document:
    return SCENE | {"camera": SCENE["camera"] | update}


BULB = SCENE | {"lights": [LIGHT | {"type": "point", "position": [-2, 4, 0.5]}]}

MISTAKES: dict[str, tuple[str, Document]] = {
    "no shape": ("shape_missing", SCENE | {"shapes": [FLOOR, SAIL]}),
    "no highlight": ("highlights_missing", ball(specular=0.0)),
    "no ambient light": ("ambient_missing", SCENE | {"ambient": [0, 0, 0]}),
    "no light": ("light_missing", SCENE | {"lights": []}),
    "a bulb": ("hard_shadows", BULB),
    "a lamp from its middle": ("light_misplaced", lamp(corner=[-2, 4, 0.5])),
    "a lamp twice as long": ("light_misplaced", lamp(corner=[-5, 4, -2.5], edges=[[6, 0, 0], [0, 0, 6]])),
    "brightness falls": ("falloff", lamp(falloff="physical")),
    "twice the shininess": ("shininess", ball(shininess=8)),
    "twice the angle": ("field_of_view", camera(vertical_fov=90)),
    "upright": ("up_ignored", camera(up=[0, 1, 0])),
}


QUICK = {"no shape", "a bulb", "upright", "texture_upside_down"}
"""Mistakes that every test run tries."""


def swept(name: str, *values: object) -> Any:
    return pytest.param(*values, id=name, marks=() if name in QUICK else pytest.mark.slow)


@pytest.mark.slow
@pytest.mark.parametrize(("cause", "document"), [swept(name, *each) for name, each in MISTAKES.items()])
def test_mistake_of_a_scene_is_named(reference: Picture, cause: str, document: Document) -> None:
    first = explain(renderer.load_scene(SCENE), against(reference, picture(document)))[0]
    assert first.cause == cause
    assert first.rmse_after < first.rmse_before
    assert cause != "shape_missing" or "ball (shapes/1)" in first.hint


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["random", "uniform"])
def test_right_picture_has_no_cause(reference: Picture, pattern: str) -> None:
    # Trials sample pixels on a grid; a right picture on it is closer to them than to the reference.
    assert explained(reference, picture(SCENE, pattern)) == []


def test_mistakes_with_equal_pictures_are_not_named() -> None:
    """Without its light the floor is as dark as with normals that point down."""
    flat = SCENE | {"shapes": [FLOOR]}
    right, dark = picture(flat, "uniform", "uniform", 144), picture(flat | {"lights": []}, "uniform")
    assert explained(right, dark, flat) == []


def test_soft_shadows_where_hard_ones_are_intended_are_no_bands() -> None:
    hard = SCENE | {"sampling": {"light": {"pattern": "uniform", "samples": 1}}}
    right, soft = picture(SCENE, "uniform", "uniform", 1), picture(SCENE, "uniform", "uniform", 144)
    assert "light_points_shared" not in explained(right, soft, hard)


def test_undone_mistake_ends_the_search(reference: Picture) -> None:
    upside_down = picture(SCENE).linear[::-1].astype(np.float32)
    found = against(reference, picture_of(npy(upside_down), "picture.npy"))
    diagnosis = explain(renderer.load_scene(SCENE), found)
    assert diagnosis == found.causes
    assert diagnosis[0].cause == "flipped_vertically"


@pytest.mark.slow
@pytest.mark.parametrize("cause", [swept(cause, cause) for cause in COLORS])
def test_texture_read_wrongly_is_named(cause: str, tmp_path: Path) -> None:
    """The texture file is changed as the cause says; it has no symmetry."""
    v, u = np.mgrid[0:8, 0:8] / 8
    texels = np.stack((0.2 + 0.5 * u, 0.3 + 0.4 * v, 0.3 + 0.3 * u * v), axis=-1)
    pictures = {}
    for name, values in (("wrong", COLORS[cause](texels.astype(np.float32))), ("right", texels)):
        codes = np.round(255 * np.clip(values, 0, 1)).astype(np.uint8)
        Image.fromarray(codes).save(tmp_path / "tiles.png")
        tiled = {"type": "phong", "color_texture": "tiles", "ambient": 1, "diffuse": 0}
        textures = {"tiles": {"type": "image", "asset": "tiles.png"}}
        document = SCENE | {"materials": MATERIALS | {"floor": tiled}, "textures": textures}
        (tmp_path / "scene.json").write_text(json.dumps(document))
        plan = renderer.compile_scene(tmp_path / "scene.json")
        pictures[name] = picture_of(npy(renderer.render(plan).image), name)
    found = against(pictures["right"], pictures["wrong"])
    assert explain(renderer.load_scene(tmp_path / "scene.json"), found)[0].cause == cause
