"""A strength of 0 is left out: plan and bytes are those of the scene without it."""

import copy
from typing import Any

import pytest

import renderer
from schemas.json_schema import scene_json_schema
from schemas.quality import TargetQuality
from tests import solids
from tests.documents import Json, camera, mesh, phong, sampled, scene, sphere
from tests.pictures import pictures
from tests.pictures.parts import plan_of, png, same

FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}
IMAGES = {
    "bumps": {"type": "image", "asset": "bumps.png", "encoding": "linear"},
    "picture": {"type": "image", "asset": "picture.png"},
}
DARK = {"color": [0, 0, 0]}
HIDDEN = {"visible": False, **DARK}
CARD = {"center": [0, 3, 0], "normal": [0, -1, 0], "tangent": [1, 0, 0], "size": [1, 1]}
VERTICES, FACES = solids.outward([0.0, 0.8, 0.9], 0.7, 1)
Change = tuple[Json, Json]
"""Parts of a scene with a strength of 0, and the same parts of the scene without it."""


def material(written: Json, without: Json | None = None) -> Change:
    return {"materials": {"shiny": written}}, {"materials": {"shiny": without or {}}}


def light(written: Json) -> Change:
    return {"lights": [written | {"falloff": "physical"} if "direction" not in written else written]}, {}


def on_all(strengths: Json) -> Json:
    return dict.fromkeys(("plain", "shiny", "mirror"), strengths)


def board(color: list[float], *names: str) -> Change:
    """A checkerboard whose fields of some names have the colour of the others."""
    texture = {"type": "checker", "even": color, "odd": color, "filter": "box", "repeat": [3, 5]}
    assert {*names} <= {*texture}
    return (
        {"textures": {"board": texture}, "materials": {"shiny": {"color": None, "color_texture": "board"}}},
        {"materials": {"shiny": {"color": color}}},
    )


NEUTRAL: dict[str, Change] = {
    "PhongMaterial/ambient": ({"materials": on_all({"ambient": 0})}, {"ambient": None}),
    "PhongMaterial/diffuse": ({"materials": on_all({"diffuse": 0, "specular": 0})}, {"lights": None}),
    "PhongMaterial/specular": material({"specular": 0, "shininess": 700}, {"specular": None}),
    "PhongMaterial/bump_height": material({"bump_map": "bumps", "bump_height": 0}),
    "PhongMaterial/displacement_height": material({"displacement_map": "bumps", "displacement_height": 0}),
    "PhongMaterial/mirror": material({"mirror": 0, "max_depth": 40}),
    "PhongMaterial/transmission": material({"transmission": 0, "ior": 3, "max_depth": 40}),
    "Camera/lens_radius": ({"camera": {"lens_radius": 0, "focus_distance": 3}}, {}),
    "Scene/ambient": ({"ambient": [0, 0, 0]}, {"materials": on_all({"ambient": 0})}),
    "Scene/background": ({"background": [0, 0, 0]}, {"background": None}),
    "Display/exposure": ({"display": {"exposure": 0}}, {}),
    "RectangleLight/color": light({"type": "rectangle", **CARD, **HIDDEN}),
    "ParallelogramLight/color": light(
        {"type": "rectangle", "corner": [0, 3, 0], "edges": [[1, 0, 0], [0, 0, 1]], **HIDDEN}
    ),
    "PointLight/color": light({"type": "point", "position": [0, 3, 0], **DARK}),
    "SpotLight/color": light({"type": "spot", "position": [0, 3, 0], "direction": [0, -1, 0], **DARK}),
    "DirectionalLight/color": light({"type": "directional", "direction": [0, -1, 0], **DARK}),
    "CheckerTexture/even": board([0, 0, 0], "even"),
    "CheckerTexture/odd": board([0.3, 0.5, 0.7], "odd"),
    "Turn/degrees": ({"shapes": [{"rotate": {"axis": [0, 1, 0], "degrees": 0}}]}, {}),
}
OTHERS = {
    "PhongMaterial/color": "black reflects nothing, and still has highlights",
    "PhongMaterial/shininess": "an exponent: 0 is the widest highlight",
    "SpotLight/inner_angle": "an angle: 0 is the widest edge of a cone",
}
"""Numbers that may be 0 and are no strengths."""


def may_be_0(about: Json) -> bool:
    """Whether a property is a number that may be 0, or a colour."""
    is_color = about.get("maxItems") == 3 and about["items"].get("minimum") == 0
    is_number = about.get("type") == "number" and about.get("minimum", 0) <= 0 and "not" not in about
    return is_color or (is_number and "exclusiveMinimum" not in about)


def test_strengths_of_the_language_are_all_known() -> None:
    schema = scene_json_schema()
    found = {
        f"{model}/{name}"
        for model, about in {**schema["$defs"], "Scene": schema}.items()
        for name, part in about.get("properties", {}).items()
        if any(map(may_be_0, (part, *part.get("anyOf", ()))))
    }
    assert found == {*NEUTRAL, *OTHERS}


def base() -> Json:
    """A mesh and a mirror ball on a floor under a lamp: paths go on, and shadows are soft."""
    shapes = [mesh(VERTICES, FACES, material="shiny"), sphere([1.2, 0.7, 0], 0.7, material="mirror")]
    return scene(
        *shapes,
        pictures.FLOOR,
        camera=camera(width=12, height=9),
        lights=[pictures.CEILING_LAMP | {"visible": False}],
        materials=pictures.SHINY | {"mirror": phong(mirror=0.6, max_depth=2)},
        textures=IMAGES,
        sampling=sampled(1, 4),
    )


def changed(document: Any, change: Any) -> Any:
    """A document with parts set; None takes a part away. Lights are added, and the first shape is changed."""
    for name, value in change.items():
        if value is None:
            document.pop(name, None)
        elif name == "lights":
            document[name] = [*document[name], *value]
        elif name == "shapes":
            document[name][0] |= value[0]
        elif isinstance(value, dict) and isinstance(document.get(name), dict):
            changed(document[name], value)
        else:
            document[name] = copy.deepcopy(value)
    return document


TARGET = TargetQuality(mode="target", error=12 / 255)


def described(plan: renderer.RenderPlan) -> Any:
    stages = plan.describe()
    return [(stage.name, stage.detail, stage.share) for stage in stages.stages], [
        (stage.name, stage.detail) for stage in stages.pilot_samples or ()
    ]


@pytest.mark.parametrize("name", NEUTRAL)
def test_strength_of_0_changes_neither_plan_nor_picture(name: str) -> None:
    written, without = (changed(copy.deepcopy(base()), change) for change in NEUTRAL[name])
    for quality in (None, TARGET):
        plan, expected = (plan_of(document, quality, files=FILES) for document in (written, without))
        assert described(plan) == described(expected)
        assert same(renderer.render(plan).image, renderer.render(expected).image)
