"""A plan has what the scene needs, with pointers, and nothing else."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
import scenes
from renderer.integrator import centre_points
from renderer.interaction import Viewers
from renderer.plan.effects import LIGHTS, SHAPES, TEXTURES
from renderer.shapes.family import Location
from renderer.tiling import blocks
from schemas.api.plans import PlanDocument
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from schemas.tiles import Tile
from tests.documents import (
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
    spot,
    sun,
    triangle,
)
from tests.pictures import pictures
from tests.pictures.parts import plan_of, png

CORNERS = ([-2, -1, 0], [2, -1, 0.1], [0, 2, 0.2])
GALLERY = sorted((Path(scenes.__file__).parent / "gallery").glob("*.json"))
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
FLAT = triangle([0, 0, 0], [1, 1, 1], [2, 2, 2])
ABOVE = lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2])
BOARD = {"type": "checker"}
IMAGE = {"type": "image", "asset": "picture.png"}
FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}
SUN_ABOVE = sun([0, -1, 0])


def described(document: Json, **options: Any) -> PlanDocument:
    return plan_of(document, files=FILES, **options).describe()


def names(document: Json) -> list[str]:
    return [stage.name for stage in described(document).stages]


def shadow_rays(document: Json) -> int:
    return int(renderer.render(plan_of(document, files=FILES)).report["rays"]["shadow"])


def resolved(pointer: str, document: Any) -> Any:
    for token in pointer.split("/")[1:]:
        name = token.replace("~1", "/").replace("~0", "~")
        document = document[int(name)] if isinstance(document, list) else document[name]
    return document


@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_stages_of_the_gallery_have_pointers(path: Path) -> None:
    """To lines that are there, for every shape and light; the plan is JSON."""
    document = json.loads(path.read_bytes())
    document["camera"] |= {"width": 32, "height": 24}
    loaded = renderer.load_scene(document, assets=path.parent)
    plan = renderer.compile_scene(loaded).describe()
    pilots = renderer.compile_scene(loaded, TargetQuality(error=0.004)).describe().pilot_samples
    assert bool(pilots) == (document["camera"].get("lens_radius", 0) == 0)
    requested = {pointer for stage in plan.stages for pointer in stage.pointers}
    for stage in (*plan.left_out, *pilots):
        requested.update(stage.pointers)
    assert all(resolved(pointer, document) is not None for pointer in requested)
    everything = {"/camera"} | {f"/shapes/{i}" for i in range(len(document["shapes"]))}
    assert everything | {f"/lights/{i}" for i in range(len(document["lights"]))} <= requested
    assert all(stage.pointers for stage in plan.stages)
    assert sum(stage.share or 0 for stage in plan.stages) == pytest.approx(1)
    text = json.dumps(plan.model_dump(mode="json"), allow_nan=False)
    assert PlanDocument.model_validate_json(text) == plan


def test_scene_with_everything_lists_every_stage() -> None:
    document = pictures.many_lights()
    document["shapes"] += pictures.carved()["shapes"]
    document["textures"] = pictures.carved()["textures"] | pictures.checkered()["textures"]
    document["materials"] = {
        "plain": phong(color_texture="picture", normal_map="bumps", specular=0.4, shininess=500),
        "shiny": phong(specular=0.6, shininess=20),
    }
    kinds = ("rectangle", "ellipsoid", "triangle")
    shading = ["diffuse term", "highlights", "highlights"]
    assert names(document) == [
        "camera rays",
        *(f"hits of {kind}s" for kind in kinds),
        "visible lights",
        *(f"points on {kind}s" for kind in kinds),
        *("materials", "color texture picture", "normal map bumps", "normals at the horizon", "ambient term"),
        *(
            name
            for i in range(4)
            for name in (f"points of light {i}", *(f"shadows of {kind}s" for kind in kinds), *shading)
        ),
    ]
    assert names(scene(materials={}, ambient=[0, 0, 0])) == ["camera rays"]


def test_normals_are_bent_only_where_something_tilts_them() -> None:
    facet = ([0, 0, 0], [1, 0, 0], [0, 1, 0])
    smooth = triangle(*facet, normals=[[0, 0, 1], [0, 1, 1], [1, 0, 1]])
    heights = {"bumps": {"type": "image", "asset": "bumps.png"}}
    tilted = phong(bump_map="bumps", bump_height=0.1)
    plan = described(scene(FLOOR, smooth, textures=heights, materials={"plain": tilted}))
    asking = [stage.pointers for stage in plan.stages if stage.name == "normals at the horizon"]
    assert asking == [("/shapes/1", "/materials/plain/bump_map")]
    assert "normals at the horizon" not in names(scene(FLOOR, triangle(*facet)))


def of(**material: Any) -> Json:
    return {"plain": phong(**material)}


BLACK_BOARD = {"x": BOARD | {"even": [0.1, 0.1, 0.1]}}


@pytest.mark.parametrize(
    ("document", "effect", "pointer"),
    [
        (scene(FLOOR, lights=[bulb([0, 1, 0], [0, 0, 0])]), "lights.point", "/lights/0"),
        (scene(FLOOR, lights=[SUN_ABOVE], materials=of(diffuse=0.0)), "lights.directional", "/lights/0"),
        (scene(FLOOR, ambient=[0, 0, 0]), "ambient", "/ambient"),
        (scene(FLOOR, materials=of(ambient=0.0)), "ambient", "/ambient"),
        (scene(FLOOR, lights=[ABOVE]), "shadow rays", "/lights/0"),
        (scene(FLOOR, FLAT), "shapes.triangle", "/shapes/1"),
        (scene(FLOOR, materials=of() | {"a/b~c": phong()}), "materials.phong", "/materials/a~1b~0c"),
        (scene(FLOOR, textures={"x": BOARD}), "textures.checker", "/textures/x"),
        (
            scene(FLOOR, textures={"x": IMAGE}, materials=of(bump_map="x")),
            "materials.phong.bump_map",
            "/materials/plain/bump_map",
        ),
        (
            scene(FLOOR, textures=BLACK_BOARD, materials=of(color_texture="x")),
            "textures.checker",
            "/materials/plain/color_texture",
        ),
    ],
    ids=["black light", "black material", "no ambient", "no ambient share", "one convex shape",
         "flat triangle", "unused material", "unused texture", "height 0", "one colour"],
)  # fmt: skip
def test_left_out_effects_have_a_reason(document: Json, effect: str, pointer: str) -> None:
    found = [item for item in described(document).left_out if item.effect == effect]
    assert [item.pointers for item in found] == [(pointer,)]
    assert found[0].reason


CENTER_FORM = {
    "type": "rectangle",
    "center": [0, 0, 0],
    "normal": [0, 1, 0],
    "tangent": [1, 0, 0],
    "size": [9, 9],
}
POISONED = [
    ("shapes", "Ellipsoid", ellipsoid([0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1])),
    ("shapes", "Sphere", sphere([0, 1, 0], 1)),
    ("shapes", "Triangle", triangle([0, 1, 0], [1, 1, 0], [0, 2, 0])),
    ("shapes", "Parallelogram", FLOOR),
    ("lights", "PointLight", bulb([0, 3, 0])),
    ("lights", "SpotLight", spot([0, 3, 0], [0, -1, 0])),
    ("lights", "DirectionalLight", SUN_ABOVE),
    ("lights", "ParallelogramLight", ABOVE),
    ("textures", "ImageTexture", IMAGE),
    ("textures", "CheckerTexture", BOARD),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "name", "part"), POISONED, ids=[name for _, name, _ in POISONED])
def test_effect_that_is_not_needed_is_not_built(
    kind: str, name: str, part: Json, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Building it fails: a scene without it renders, a scene with it does not."""

    def poison(*_: Any) -> Any:
        raise AssertionError(name)

    table: dict[Any, Any] = {"shapes": SHAPES, "lights": LIGHTS, "textures": TEXTURES}[kind]
    (key,) = (key for key in table if key.__name__ == name)
    without = scene(CENTER_FORM | {"material": "plain"}, lights=[CENTER_FORM | {"color": [1, 1, 1]}])
    parts: dict[str, Json] = {
        "shapes": {"shapes": [*without["shapes"], part]},
        "lights": {"lights": [part]},
        "textures": {"textures": {"t": part}, "materials": of(color_texture="t")},
    }
    monkeypatch.setitem(table, key, replace(table[key], build=poison))
    assert renderer.render(plan_of(without, files=FILES)).image.any()
    with pytest.raises(AssertionError, match=name):
        plan_of(without | parts[kind], files=FILES)


BOX = {"board": BOARD | {"filter": "box"}}
FILTERED = {"coordinates", "derivatives", "viewers", "footprints"}


@pytest.mark.parametrize(
    ("material", "parts"),
    [
        ({}, set()),
        ({"specular": 0.5}, {"viewers"}),
        ({"mirror": 0.5}, {"viewers"}),
        ({"color_texture": "image"}, {"coordinates"}),
        ({"color_texture": "board"}, FILTERED),
        ({"normal_map": "image"}, {"coordinates", "frames", "viewers"}),
        ({"bump_map": "image", "bump_height": 0.1}, {"coordinates", "derivatives", "viewers"}),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
@pytest.mark.parametrize("shape", [FLOOR, sphere([0, 1, 0], 1), triangle([0, 0, 0], [1, 0, 0], [0, 2, 0])])
def test_points_have_what_some_stage_reads(material: Json, parts: set[str], shape: Json) -> None:
    document = scene(shape, lights=[ABOVE], textures={"image": IMAGE} | BOX, materials=of(**material))
    plan = plan_of(document, files=FILES)
    (block,) = blocks(Tile(0, 0, 0, plan.width, plan.height), plan.passes[0])
    points = centre_points(plan, Counter(), block)
    assert points.count
    assert {name for name in (*FILTERED, "frames") if hasattr(points, name)} == parts


def without(plan: renderer.RenderPlan, part: str) -> renderer.RenderPlan:
    """A plan whose points lack something."""
    stages = (
        replace(stage, reads=stage.reads - {part}) if isinstance(stage, Location) else stage
        for stage in plan.surfaces
        if part != "viewers" or not isinstance(stage, Viewers)
    )
    return replace(plan, surfaces=tuple(stages))


@pytest.mark.parametrize("part", ["viewers", "coordinates", "frames", "derivatives"])
def test_what_no_stage_asked_for_cannot_be_read(part: str) -> None:
    maps = {"board": phong(color_texture="board"), "map": phong(normal_map="image")}
    shapes = [FLOOR | {"material": "board"}, sphere([0, 1, 0], 1, material="map")]
    plan = plan_of(scene(*shapes, textures={"image": IMAGE} | BOX, materials=maps), files=FILES)
    assert renderer.render(plan).image.any()
    with pytest.raises(AttributeError, match=part):
        renderer.render(without(plan, part))


def test_texture_that_nothing_shows_is_not_read() -> None:
    lost = scene(FLOOR, textures={"lost": {"type": "image", "asset": "lost.png"}})
    assert renderer.render(plan_of(lost)).image.any()


def test_shadow_rays_need_a_light_and_a_shape() -> None:
    ball = sphere([0, 1, 0], 1)
    assert shadow_rays(scene(FLOOR, ball)) == 0
    assert shadow_rays(scene(FLOOR, ball, lights=[bulb([0, 3, 0], [0, 0, 0])])) == 0
    assert shadow_rays(scene(lights=[ABOVE, bulb([0, 3, 0])], materials={})) == 0


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
def test_shadow_rays_need_a_surface_in_reach(light: Json) -> None:
    """Two tiles of a floor, seen from above."""
    tiles = [rectangle([x, 0, -4], [0, 0, 8], [4, 0, 0]) for x in (-4, 0)]
    view = camera(position=[0.1, 6, 0.2], look_at=[0, 0, 0], up=[0, 0, -1])
    assert shadow_rays(scene(*tiles, camera=view, lights=[light], sampling=sampled(1, 9))) == 0
    assert shadow_rays(scene(*tiles, camera=view, lights=[SUN_ABOVE])) > 0


@pytest.mark.parametrize("light", ["uniform", "random", "stratified", "sobol"])
def test_fixed_quality_casts_every_shadow_ray(light: str) -> None:
    """A floor that fills the picture, all of it above the horizon of three lights."""
    tiles = [rectangle([x, 0, -40], [0, 0, 80], [40, 0, 0]) for x in (-40, 0)]
    document = scene(
        *tiles,
        camera=camera(position=[0.1, 6, 0.2], look_at=[0, 0, 0], up=[0, 0, -1], width=9, height=7),
        lights=[lamp([-1, 9, -1], [2, 0, 0], [0, 0, 2]), bulb([0, 8, 0]), SUN_ABOVE],
        sampling=sampled(4, 16, light=light),
    )
    report = renderer.render(plan_of(document)).report
    points = 9 * 7 * 4
    assert report["rays"] == {"camera": points, "shadow": points * 18, "mirror": 0, "transmission": 0}
    assert report["samples"] == {"antialiasing_mean": 4.0, "light_mean": 6.0}
    cost = report["plan"]["cost"]
    assert (cost["camera_rays"], cost["shadow_rays"]) == (points, points * 18)


def test_quality_replaces_the_sampling_of_the_scene() -> None:
    quality = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="rotated", samples=9),
        light=LightSampling(pattern="sobol", samples=5),
        precision="double",
    )
    plan = plan_of(pictures.of_room(), quality)
    assert (plan.antialiasing.pattern, plan.antialiasing.samples) == ("rotated", 9)
    assert (plan.light_points, plan.dtype) == (5, np.float64)
    part = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=1))
    assert plan_of(pictures.of_room(), part).antialiasing == plan_of(pictures.of_room()).antialiasing


@pytest.mark.parametrize("samples", [1, 4, 16, 64, 100])
def test_passes_share_out_every_sample_once(samples: int) -> None:
    plan = plan_of(scene(FLOOR, sampling=sampled(samples)))
    assert plan.passes[0].stride > 1
    assert [i for each in plan.passes[1:] for i in range(each.first, each.last)] == list(range(samples))
    assert [each.index for each in plan.passes] == list(range(len(plan.passes)))
    few, many = (described(pictures.of_room(sampling=sampled(n, 16))).cost for n in (1, samples))
    assert many.camera_rays == samples * few.camera_rays
    assert many.cpu_seconds == pytest.approx(samples * few.cpu_seconds)


def test_price_of_glass_follows_from_its_rays() -> None:
    """One ball, and four in one another, where rays multiply: within a factor of 2."""

    def ratio(balls: int, depth: int) -> float:
        document = scene(
            *(sphere([0, 1, 0], 1 - 0.2 * number, material="glass") for number in range(balls)),
            materials={
                "glass": phong(ambient=0, diffuse=0, transmission=1, max_depth=depth),
                "plain": phong(),
            },
            camera=camera(position=[0, 2, 6], look_at=[0, 1, 0], vertical_fov=24, width=24, height=20),
        )
        plan = plan_of(document)
        described = plan.describe()
        (share,) = (stage.share for stage in described.stages if stage.name == "transmitted rays")
        assert share is not None
        return share * described.cost.cpu_seconds / renderer.render(plan).report["rays"]["transmission"]

    assert 0.5 < ratio(1, 2) / ratio(4, 9) < 2


@pytest.mark.parametrize("kind", ["balls", "triangles"])
def test_price_of_shapes_follows_from_how_many_are_in_one_place(kind: str) -> None:
    """Side by side a ray passes few of 400. In one place it passes all, which takes 40 times as long."""

    def price(size: float, apart: float) -> float:
        places = [[apart * (i % 20 - 9.5), 1.4 + apart * (i // 20 - 9.5), 0] for i in range(400)]
        shapes = [
            sphere(place, size)
            if kind == "balls"
            else triangle(*(np.add(place, np.multiply(size, corner)) for corner in CORNERS))
            for place in places
        ]
        return plan_of(scene(*shapes, lights=[bulb([0, 9, 9])])).describe().cost.cpu_seconds

    assert price(2.0, 0.001) > 20 * price(0.05, 0.15)
