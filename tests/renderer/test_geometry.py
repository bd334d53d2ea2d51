"""Shapes, textures and trees of a scene are built once, however many plans and traces take them."""

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    ellipsoid,
    mesh,
    phong,
    rectangle,
    scene,
    sphere,
    triangle,
)
from accuracy.inspection import inspect, inspection_plan
from renderer.accelerators import trees
from renderer.accelerators.trees import Kept
from renderer.plan.effects import SHAPES, TEXTURES
from schemas.quality import FixedQuality, TargetQuality
from tests.pictures import pictures
from tests.pictures.parts import Files, png
from tests.solids import icosphere

FILES = Files({"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())})
TARGET = TargetQuality(mode="target", error=0.05)


def every_kind() -> Json:
    """A scene with all families, a mesh in a tree, and each texture in two places."""
    vertices, faces = icosphere([0, 3, 0], 0.5, 1)
    image = {"type": "image", "asset": "picture.png"}
    return scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0], material="picture"),
        triangle([0, 1, 0], [1, 1, 0], [0, 2, 0], material="board"),
        ellipsoid([2, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], material="mapped"),
        sphere([-2, 1, 0], 1, material="moved"),
        {**mesh(vertices, faces), "material": "plain"},
        lights=[bulb([0, 5, 2]), bulb([3, 5, 2])],
        textures={
            "picture": image,
            "normals": image | {"encoding": "linear"},
            "board": {"type": "checker"},
            "bumps": {"type": "image", "asset": "bumps.png"},
        },
        materials={
            "plain": phong(),
            "picture": phong(color_texture="picture", normal_map="normals"),
            "mapped": phong(color_texture="picture", bump_map="bumps", bump_height=0.01),
            "moved": phong(displacement_map="bumps", displacement_height=0.01),
            "board": phong(color_texture="board"),
        },
    )


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often families, textures and trees have been built; nothing is kept from other tests."""
    counts: Counter[str] = Counter()

    def counted(name: str, build: Any) -> Any:
        def counting(*arguments: Any) -> Any:
            counts[name] += 1
            return build(*arguments)

        return counting

    for table, name in ((SHAPES, "families"), (TEXTURES, "textures")):
        for kind, effect in table.items():
            replaced = replace(effect, build=counted(f"{name} of {effect.build.__module__}", effect.build))
            monkeypatch.setitem(table, kind, replaced)
    monkeypatch.setattr(trees, "_trees", Kept(counted("trees", trees.build)))
    return counts


@pytest.mark.parametrize("quality", [FixedQuality(mode="fixed"), TARGET], ids=["fixed", "target"])
def test_plan_builds_each_part_once(quality: Any, built: Counter[str]) -> None:
    renderer.compile_scene(renderer.load_scene(every_kind(), assets=FILES), quality)
    boards = 1 if isinstance(quality, FixedQuality) else 2
    assert built == {
        "families of renderer.shapes.rectangles": 1,
        "families of renderer.shapes.triangles": 1,
        "families of renderer.shapes.ellipsoids": 1,
        "families of renderer.shapes.meshes": 1,
        # The picture as colours and as stored, and the heights; pilot samples see means of the board.
        "textures of renderer.textures.mipmap": 3,
        "textures of renderer.textures.checker": boards,
        "trees": 2,
    }


def test_other_qualities_build_nothing_again(built: Counter[str]) -> None:
    scene = renderer.load_scene(every_kind(), assets=FILES)
    plan = renderer.compile_scene(scene, FixedQuality(mode="fixed"))
    inspected = inspection_plan(scene)
    built.clear()
    renderer.trace(plan, [[0, 1, 8]], [[0, 0, -1]])
    inspect(inspected, 3, 4)
    renderer.render(plan, quality={"mode": "fixed", "antialiasing": {"pattern": "center", "samples": 1}})
    assert built == {}


def test_missing_file_of_a_displaced_mesh() -> None:
    document = scene(
        {"type": "mesh", "asset": "lost.obj", "material": "moved"},
        textures={"bumps": {"type": "image", "asset": "bumps.png"}},
        materials={"moved": phong(displacement_map="bumps", displacement_height=0.1)},
    )
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(document, assets=FILES))
    assert [(problem.pointer, problem.code) for problem in caught.value.errors] == [
        ("/shapes/0/asset", "asset")
    ]
