"""A wrong picture is diagnosed by reproducing likely mistakes with the reference scene."""

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.comparison import Comparison, Picture, Policy, compare, picture_of
from schemas.grading.manifest_reading import read_manifest
from service.grading.folders import Folder
from service.grading.grading import prepare_references, reference_folder
from service.grading.kinds import findings
from service.grading.mistakes.altered_textures import COLORS, NORMALS
from service.grading.mistakes.counterfactuals import explain
from service.grading.mistakes.hints import HINTS
from service.grading.settings import Run
from tests.service.grading.assignments import SCENE as ASSIGNED
from tests.service.grading.assignments import Assignment, image_test, pixels

WIDTH, HEIGHT = 64, 48
Document = dict[str, Any]

MATT = {"type": "phong", "ambient": 0.2, "diffuse": 0.8, "specular": 0.0, "shininess": 10}


def scene(**changes: Any) -> Document:
    """A glossy ball and a triangle over a floor, seen by a tilted camera.

    The triangle leans towards the camera: the lamp lights its other side.
    """
    document: Document = {
        "version": 1,
        "camera": {
            "position": [0.5, 2.5, 5],
            "look_at": [0, 0.5, 0],
            "up": [0.2, 1, 0],
            "vertical_fov": 45,
            "width": WIDTH,
            "height": HEIGHT,
        },
        "background": [0.1, 0.1, 0.2],
        "ambient": [1, 1, 1],
        "materials": {
            "floor": MATT | {"color": [0.6, 0.6, 0.55]},
            "ball": MATT | {"color": [0.5, 0.1, 0.1], "specular": 0.9, "shininess": 4},
            "sail": MATT | {"color": [0.1, 0.5, 0.2]},
        },
        "shapes": [
            {
                "type": "rectangle",
                "corner": [-4, 0, -4],
                "edges": [[0, 0, 8], [8, 0, 0]],
                "material": "floor",
            },
            {
                "type": "ellipsoid",
                "name": "ball",
                "center": [-0.8, 1.3, 0],
                "radius": 0.8,
                "material": "ball",
            },
            {
                "type": "triangle",
                "vertices": [[0.6, 0.4, 0.4], [2, 0.4, 0], [1.2, 1.8, 1.2]],
                "material": "sail",
            },
        ],
        "lights": [
            {
                "type": "rectangle",
                "corner": [-3.5, 4, -1],
                "edges": [[3, 0, 0], [0, 0, 3]],
                "color": [0.7, 0.7, 0.7],
                "visible": False,
            }
        ],
    }
    return document | changes


def picture(document: Document, pattern: str = "random", light: str = "random", points: int = 4) -> Picture:
    sampling = {
        "antialiasing": {"pattern": pattern, "samples": 16},
        "light": {"pattern": light, "samples": points},
    }
    plan = renderer.compile_scene(document | {"sampling": sampling})
    file = io.BytesIO()
    np.save(file, renderer.render(plan).image)
    return picture_of(file.getvalue(), "picture.npy")


@pytest.fixture(scope="module")
def reference() -> Picture:
    return picture(scene(), "uniform", "uniform", 144)


def against(reference: Picture, image: Picture) -> Comparison:
    return compare(image, reference, policy=Policy(tolerance=0.005, most_bias=0.01))


def changed(field: str, **update: Any) -> Document:
    return scene(**{field: scene()[field] | update})


def without_shine() -> Document:
    return changed("materials", ball=scene()["materials"]["ball"] | {"specular": 0.0})


def lamp(**update: Any) -> Document:
    return scene(lights=[scene()["lights"][0] | update])


def bulb() -> Document:
    return scene(lights=[{"type": "point", "position": [-2, 4, 0.5], "color": [0.7, 0.7, 0.7]}])


MISTAKES: dict[str, tuple[str, Document]] = {
    "no shape": ("shape_missing", scene(shapes=scene()["shapes"][::2])),
    "no highlight": ("highlights_missing", without_shine()),
    "no ambient light": ("ambient_missing", scene(ambient=[0, 0, 0])),
    "no light": ("light_missing", scene(lights=[])),
    "a bulb": ("hard_shadows", bulb()),
    "a lamp from its middle": ("light_misplaced", lamp(corner=[-2, 4, 0.5])),
    "a lamp twice as long": (
        "light_misplaced",
        lamp(corner=[-5, 4, -2.5], edges=[[6, 0, 0], [0, 0, 6]]),
    ),
    "brightness falls": ("falloff", lamp(falloff="physical", color=[0.7, 0.7, 0.7])),
    "twice the shininess": (
        "shininess",
        changed("materials", ball=scene()["materials"]["ball"] | {"shininess": 8}),
    ),
    "twice the angle": ("field_of_view", changed("camera", vertical_fov=90)),
    "upright": ("up_ignored", changed("camera", up=[0, 1, 0])),
}


@pytest.mark.parametrize(("cause", "document"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_first(reference: Picture, cause: str, document: Document) -> None:
    found = against(reference, picture(document))
    assert not found.passed
    diagnosis = explain(renderer.load_scene(scene()), found)
    assert diagnosis[0].cause == cause
    assert diagnosis[0].rmse_after < diagnosis[0].rmse_before


def test_the_shape_that_is_missing_has_its_name_in_the_hint(reference: Picture) -> None:
    found = against(reference, picture(scene(shapes=scene()["shapes"][::2])))
    assert "ball (shapes/1) is missing" in explain(renderer.load_scene(scene()), found)[0].hint


@pytest.mark.parametrize("pattern", ["random", "stratified", "uniform"])
def test_a_right_picture_has_no_cause(reference: Picture, pattern: str) -> None:
    """Trials sample pixels on a grid; a right picture on it is closer to them than to the reference."""
    found = against(reference, picture(scene(), pattern))
    assert explain(renderer.load_scene(scene()), found) == ()


def test_bands_in_a_penumbra_are_distinguished_from_noise(reference: Picture) -> None:
    """Compare four grid points shared by all pixels with four random points per pixel."""
    bands, noise = (
        explain(renderer.load_scene(scene()), against(reference, picture(scene(), "uniform", light, 4)))
        for light in ("uniform", "random")
    )
    assert [cause.cause for cause in bands] == ["light_points_shared"]
    assert noise == ()


def test_nothing_is_tried_without_a_budget(reference: Picture) -> None:
    found = against(reference, picture(without_shine()))
    assert explain(renderer.load_scene(scene()), found, budget=0) == ()


def test_two_mistakes_that_give_the_same_picture_are_not_named() -> None:
    """A light in front of a floor: without it the floor is as dark as with normals that point down."""
    flat = scene(shapes=scene()["shapes"][:1])
    right, dark = picture(flat, "uniform", "uniform", 144), picture(flat | {"lights": []}, "uniform")
    assert explain(renderer.load_scene(flat), against(right, dark)) == ()


def test_a_vague_cause_is_named_only_after_all_others_were_tried(assignment: Assignment) -> None:
    """Half the light looks like half the exposure; the diagnosis that a deadline leaves does not say so."""
    manifest = read_manifest(assignment.manifest(image_test()).read_bytes(), yaml=False)
    assignment.hand_in("picture.npy", pixels(ASSIGNED) * 0.5)
    run = Run(
        manifest,
        Folder(assignment.references.resolve(), "reference"),
        Folder(assignment.submission.resolve(), "submission"),
    )
    with reference_folder(None) as folder:
        run = replace(run, prepared=prepare_references(run, 1, folder)[0])
        first, last = findings(manifest.tests[0], run)
    assert first.diagnosis == ()
    assert last.diagnosis[0].cause == "exposure"


def test_no_mistake_is_reproduced_if_undoing_one_explains_the_difference(reference: Picture) -> None:
    upside_down = picture(scene())
    file = io.BytesIO()
    np.save(file, upside_down.linear[::-1].astype(np.float32))
    found = against(reference, picture_of(file.getvalue(), "picture.npy"))
    diagnosis = explain(renderer.load_scene(scene()), found)
    assert diagnosis == found.causes
    assert diagnosis[0].cause == "flipped_vertically"


def test_every_change_of_a_texture_has_its_hint() -> None:
    assert {*COLORS, *NORMALS} <= HINTS.keys()


@pytest.mark.parametrize("cause", COLORS)
def test_a_texture_that_is_read_wrongly_is_named(cause: str, tmp_path: Path) -> None:
    """The texture file is changed as the cause says; it has no symmetry."""
    from PIL import Image

    v, u = np.mgrid[0:8, 0:8] / 8
    texels = np.stack((0.2 + 0.5 * u, 0.3 + 0.4 * v, 0.3 + 0.3 * u * v), axis=-1)
    Image.fromarray(np.round(255 * texels).astype(np.uint8)).save(tmp_path / "right.png")
    wrong = np.round(255 * np.clip(COLORS[cause](texels.astype(np.float32)), 0, 1)).astype(np.uint8)
    Image.fromarray(wrong).save(tmp_path / "wrong.png")
    pictures = []
    for name in ("right", "wrong"):
        document = scene(
            materials=scene()["materials"]
            | {"floor": {"type": "phong", "color_texture": "tiles", "ambient": 1, "diffuse": 0}},
            textures={"tiles": {"type": "image", "asset": f"{name}.png"}},
        )
        (tmp_path / f"{name}.json").write_text(json.dumps(document))
        plan = renderer.compile_scene(tmp_path / f"{name}.json")
        file = io.BytesIO()
        np.save(file, renderer.render(plan).image)
        pictures.append(picture_of(file.getvalue(), name))
    found = against(pictures[0], pictures[1])
    assert explain(renderer.load_scene(tmp_path / "right.json"), found)[0].cause == cause
