"""A plan holds what the scene needs, says which part of the scene requested it, and runs nothing else."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
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
from renderer.plan.effects import LIGHTS, SHAPES, TEXTURES
from schemas.api.plans import PlanDocument
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from tests.pictures import pictures
from tests.pictures.parts import plan_of, png

GALLERY = sorted((Path(__file__).parents[2] / "scenes" / "gallery").glob("*.json"))
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
ABOVE = lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2])
FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}


def described(document: Json, **options: Any) -> PlanDocument:
    return plan_of(document, files=FILES, **options).describe()


def names(document: Json) -> list[str]:
    return [stage.name for stage in described(document).stages]


def resolved(pointer: str, document: Any) -> Any:
    for token in pointer.split("/")[1:]:
        name = token.replace("~1", "/").replace("~0", "~")
        document = document[int(name)] if isinstance(document, list) else document[name]
    return document


def shadow_rays(document: Json, quality: Any = None) -> int:
    return int(renderer.render(plan_of(document, quality, files=FILES)).report["rays"]["shadow"])


@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_pointers_of_the_gallery(path: Path) -> None:
    document = json.loads(path.read_bytes())
    plan = renderer.compile_scene(path).describe()
    requested = {pointer for stage in plan.stages for pointer in stage.pointers}
    for pointer in requested | {pointer for item in plan.left_out for pointer in item.pointers}:
        resolved(pointer, document)
    everything = {"/camera"} | {f"/shapes/{i}" for i in range(len(document["shapes"]))}
    everything |= {f"/lights/{i}" for i in range(len(document["lights"]))}
    assert everything <= requested
    assert all(stage.pointers for stage in plan.stages)
    assert sum(stage.share or 0 for stage in plan.stages) == pytest.approx(1)


def test_scene_with_everything() -> None:
    document = pictures.many_lights()
    document["shapes"] += pictures.carved()["shapes"]
    document["textures"] = pictures.carved()["textures"] | pictures.checkered()["textures"]
    document["materials"] = {
        "plain": phong(color_texture="picture", normal_map="bumps", specular=0.4, shininess=500),
        "shiny": phong(specular=0.6, shininess=20),
    }
    shadows = [f"shadows of {kind}s" for kind in ("rectangle", "ellipsoid", "triangle")]
    light = [*shadows, "diffuse term", "highlights", "highlights"]
    assert names(document) == [
        "camera rays",
        *(f"hits of {kind}s" for kind in ("rectangle", "ellipsoid", "triangle")),
        "visible lights",
        *(f"points on {kind}s" for kind in ("rectangle", "ellipsoid", "triangle")),
        "materials",
        "color texture picture",
        "normal map bumps",
        "normals at the horizon",
        "ambient term",
        *(name for i in range(4) for name in (f"points of light {i}", *light)),
    ]


def test_normals_bend_only_where_needed() -> None:
    facet = ([0, 0, 0], [1, 0, 0], [0, 1, 0])
    smooth = triangle(*facet, normals=[[0, 0, 1], [0, 1, 1], [1, 0, 1]])
    height = {"type": "image", "asset": "bumps.png"}
    tilted = phong(bump_map="bumps", bump_height=0.1)
    document = scene(FLOOR, smooth, textures={"bumps": height}, materials={"plain": tilted})
    asking = [
        stage.pointers for stage in described(document).stages if stage.name == "normals at the horizon"
    ]
    assert asking == [("/shapes/1", "/materials/plain/bump_map")]
    flat = scene(FLOOR, triangle(*facet), materials={"plain": phong()})
    assert "normals at the horizon" not in names(flat)
    assert not plan_of(flat).bent


def test_empty_scene_has_camera_rays() -> None:
    assert names(scene(materials={}, ambient=[0, 0, 0])) == ["camera rays"]


@pytest.mark.parametrize(
    ("document", "effect", "pointers", "reason"),
    [
        (scene(FLOOR, lights=[bulb([0, 1, 0], [0, 0, 0])]), "lights.point", ["/lights/0"], "black"),
        (
            scene(FLOOR, lights=[sun([0, -1, 0])], materials={"plain": phong(diffuse=0.0)}),
            "lights.directional",
            ["/lights/0"],
            "no material in use reflects light",
        ),
        (scene(FLOOR, ambient=[0, 0, 0]), "ambient", ["/ambient"], "there is no ambient light"),
        (
            scene(FLOOR, materials={"plain": phong(ambient=0.0)}),
            "ambient",
            ["/ambient"],
            "no material in use reflects ambient light",
        ),
        (scene(FLOOR, lights=[ABOVE]), "shadow rays", ["/lights/0"], "a single convex shape"),
        (
            scene(FLOOR, triangle([0, 0, 0], [1, 1, 1], [2, 2, 2])),
            "shapes.triangle",
            ["/shapes/1"],
            "its three vertices lie on one line",
        ),
        (
            scene(FLOOR, materials={"plain": phong(), "a/b~c": phong()}),
            "materials.phong",
            ["/materials/a~1b~0c"],
            "no shape has this material",
        ),
        (
            scene(FLOOR, textures={"x": {"type": "checker"}}),
            "textures.checker",
            ["/textures/x"],
            "no material that is shown uses this texture",
        ),
        (
            scene(
                FLOOR,
                textures={"x": {"type": "image", "asset": "picture.png"}},
                materials={"plain": phong(bump_map="x")},
            ),
            "materials.phong.bump_map",
            ["/materials/plain/bump_map"],
            "its height is 0",
        ),
        (
            scene(
                FLOOR,
                textures={"x": {"type": "checker", "even": [0.1, 0.1, 0.1]}},
                materials={"plain": phong(color_texture="x")},
            ),
            "textures.checker",
            ["/materials/plain/color_texture"],
            "one colour everywhere",
        ),
    ],
)
def test_left_out_effects_have_reasons(document: Json, effect: str, pointers: list[str], reason: str) -> None:
    found = [item for item in described(document).left_out if item.effect == effect]
    assert [list(item.pointers) for item in found] == [pointers]
    assert reason in found[0].reason


POISONED = [
    (SHAPES, "Ellipsoid", ellipsoid([0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1])),
    (SHAPES, "Sphere", sphere([0, 1, 0], 1)),
    (SHAPES, "Triangle", triangle([0, 1, 0], [1, 1, 0], [0, 2, 0])),
    (SHAPES, "Parallelogram", FLOOR),
    (LIGHTS, "PointLight", bulb([0, 3, 0])),
    (LIGHTS, "DirectionalLight", sun([0, -1, 0])),
    (LIGHTS, "ParallelogramLight", ABOVE),
    (TEXTURES, "ImageTexture", {"type": "image", "asset": "picture.png"}),
    (TEXTURES, "CheckerTexture", {"type": "checker"}),
]


@pytest.mark.parametrize(("table", "name", "part"), POISONED, ids=[name for _, name, _ in POISONED])
def test_unused_effects_are_not_built(
    table: dict[type, Any], name: str, part: Json, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Building it fails: a scene without it renders, a scene with it does not."""

    def poison(*_: Any) -> Any:
        raise AssertionError(name)

    (key,) = (key for key in table if key.__name__ == name)
    center_form = {
        "type": "rectangle",
        "center": [0, 0, 0],
        "normal": [0, 1, 0],
        "tangent": [1, 0, 0],
        "size": [9, 9],
    }
    without = scene(center_form | {"material": "plain"}, lights=[center_form | {"color": [1, 1, 1]}])
    parts = {
        id(SHAPES): {"shapes": [*without["shapes"], part]},
        id(LIGHTS): {"lights": [part]},
        id(TEXTURES): {"textures": {"t": part}, "materials": {"plain": phong(color_texture="t")}},
    }
    monkeypatch.setitem(table, key, replace(table[key], build=poison))
    assert renderer.render(plan_of(without, files=FILES)).image.any()
    with pytest.raises(AssertionError, match=name):
        plan_of(without | parts[id(table)], files=FILES)


def test_unused_texture_is_not_read() -> None:
    document = scene(FLOOR, textures={"lost": {"type": "image", "asset": "lost.png"}})
    assert renderer.render(plan_of(document)).image.any()


HIDDEN = {"visible": False}


@pytest.mark.parametrize(
    "light",
    [
        lamp([-1, -3, -1], [2, 0, 0], [0, 0, 2], **HIDDEN),
        bulb([0, -1e-9, 0]),
        sun([0.1, 1, 0.2]),
        sun([1, 0, 0]),
        lamp([-1, 3, -1], [0, 0, 2], [2, 0, 0], two_sided=False, **HIDDEN),
    ],
    ids=["below", "just below", "from below", "along the floor", "one-sided from behind"],
)
def test_light_that_reaches_nothing(light: Json) -> None:
    """Two tiles of a floor, seen from above."""
    tiles = [rectangle([x, 0, -4], [0, 0, 8], [4, 0, 0]) for x in (-4, 0)]
    view = camera(position=[0.1, 6, 0.2], look_at=[0, 0, 0], up=[0, 0, -1])
    assert shadow_rays(scene(*tiles, camera=view, lights=[light], sampling=sampled(1, 9))) == 0
    assert shadow_rays(scene(*tiles, camera=view, lights=[sun([0, -1, 0])])) > 0


@pytest.mark.parametrize("light", ["uniform", "random", "stratified", "sobol"])
def test_shadow_rays_of_fixed_quality(light: str) -> None:
    """A floor that fills the picture, all of it above the horizon of three lights."""
    tiles = [rectangle([x, 0, -40], [0, 0, 80], [40, 0, 0]) for x in (-40, 0)]
    document = scene(
        *tiles,
        camera=camera(position=[0.1, 6, 0.2], look_at=[0, 0, 0], up=[0, 0, -1], width=9, height=7),
        lights=[lamp([-1, 9, -1], [2, 0, 0], [0, 0, 2]), bulb([0, 8, 0]), sun([0, -1, 0])],
        sampling=sampled(4, 16, light=light),
    )
    report = renderer.render(plan_of(document)).report
    points = 9 * 7 * 4
    shadow = points * (16 + 1 + 1)
    assert report["rays"] == {"camera": points, "shadow": shadow, "mirror": 0, "transmission": 0}
    assert report["samples"] == {"antialiasing_mean": 4.0, "light_mean": 6.0}
    assert report["plan"]["cost"]["camera_rays"] == points
    assert report["plan"]["cost"]["shadow_rays"] == points * 18


def test_quality_replaces_sampling() -> None:
    quality = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="rotated", samples=9),
        light=LightSampling(pattern="sobol", samples=5),
        precision="double",
    )
    plan = plan_of(pictures.of_room(), quality)
    assert (plan.antialiasing.pattern, plan.antialiasing.samples) == ("rotated", 9)
    assert plan.light_points == 5
    assert plan.dtype == np.float64
    assert [(p.first, p.last) for p in plan.passes] == [(0, 1), (0, 1), (1, 4), (4, 9)]
    part = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=1))
    assert plan_of(pictures.of_room(), part).antialiasing == plan_of(pictures.of_room()).antialiasing


@pytest.mark.parametrize(
    ("samples", "rounds"),
    [(1, [1]), (4, [1, 4]), (16, [1, 4, 16]), (64, [1, 4, 16, 64]), (100, [1, 4, 16, 64, 100])],
)
def test_passes_share_every_sample(samples: int, rounds: list[int]) -> None:
    plan = plan_of(scene(FLOOR, sampling=sampled(samples)))
    assert plan.passes[0].stride > 1
    assert [pass_.last for pass_ in plan.passes[1:]] == rounds
    assert [pass_.first for pass_ in plan.passes[1:]] == [0, *rounds[:-1]]
    assert [pass_.index for pass_ in plan.passes] == list(range(len(plan.passes)))
