"""Shapes and textures of a scene are built once, however many plans and traces use them."""

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

import renderer
from accuracy.inspection import inspect, inspection_plan
from renderer.plan.effects import SHAPES, TEXTURES
from schemas.quality import FixedQuality, TargetQuality
from tests.documents import Json, bulb, ellipsoid, mesh, phong, rectangle, scene, sphere, triangle
from tests.pictures import pictures
from tests.pictures.parts import Files, png
from tests.solids import icosphere

FILES = Files({"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())})
IMAGE: Json = {"type": "image", "asset": "picture.png"}
EVERY_KIND = scene(
    rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0], material="picture"),
    triangle([0, 1, 0], [1, 1, 0], [0, 2, 0], material="board"),
    ellipsoid([2, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], material="mapped"),
    sphere([-2, 1, 0], 1, material="moved"),
    mesh(*icosphere([0, 3, 0], 0.5, 1)),
    lights=[bulb([0, 5, 2]), bulb([3, 5, 2])],
    textures={
        "picture": IMAGE,
        "normals": IMAGE | {"encoding": "linear"},
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
"""All families, a mesh in a tree, and each texture in two places."""


@pytest.mark.parametrize("quality", [FixedQuality(), TargetQuality(error=0.05)], ids=["fixed", "target"])
def test_plans_of_a_scene_share_what_was_built(quality: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    built: Counter[str] = Counter()

    def counted(name: str, build: Any) -> Any:
        return lambda *arguments: built.update([name]) or build(*arguments)

    for table in (SHAPES, TEXTURES):
        for kind, effect in table.items():
            name = effect.build.__module__.rpartition(".")[2]
            monkeypatch.setitem(table, kind, replace(effect, build=counted(name, effect.build)))
    loaded = renderer.load_scene(EVERY_KIND, assets=FILES)
    plan = renderer.compile_scene(loaded, quality)
    families = {"rectangles": 1, "triangles": 1, "ellipsoids": 1, "meshes": 1}
    # The picture as colours and as stored, and the heights; pilot samples see means of the board.
    boards = 1 if isinstance(quality, FixedQuality) else 2
    assert built == {**families, "mipmap": 3, "checker": boards}
    inspected = inspection_plan(loaded)
    built.clear()
    renderer.trace(plan, [[0, 1, 8]], [[0, 0, -1]])
    inspect(inspected, 3, 4)
    renderer.render(plan, quality={"mode": "fixed", "antialiasing": {"pattern": "center", "samples": 1}})
    assert not built
