"""Packaged scenes: no bad pixel in any, and the hard ones look as their geometry says."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import renderer
import scenes
from schemas.quality import Antialiasing, FixedQuality
from tests.documents import rectangle

FOLDER = Path(scenes.__file__).parent / "hard"
PACKAGED = sorted(path for folder in ("gallery", "hard") for path in (FOLDER.parent / folder).glob("*.json"))
CENTRES = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="center", samples=1))
BORDERS = 0.001
"""Share of pixels, all at borders, that may change where a border moves by less than 1/100 of a pixel."""


def rendered(
    name: str | dict[str, Any], *layers: str, quality: FixedQuality = CENTRES
) -> renderer.RenderResult:
    source = FOLDER / f"{name}.json" if isinstance(name, str) else name
    return renderer.render(renderer.compile_scene(source, quality, layers=layers))


def document(name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return content


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("path", PACKAGED, ids=lambda path: path.stem)
def test_scenes_have_no_bad_pixel(path: Path, precision: Literal["single", "double"]) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    content["camera"] |= {"width": 48, "height": 32}
    scene = renderer.load_scene(content, assets=path.parent)
    quality = CENTRES.model_copy(update={"precision": precision})
    result = renderer.render(renderer.compile_scene(scene, quality))
    assert set(result.report["numerics"].values()) == {0}
    assert np.isfinite(result.image).all()
    assert result.image.min() >= 0


@pytest.mark.parametrize("precision", ["single", "double"])
def test_closed_room_is_dark(precision: Literal["single", "double"]) -> None:
    result = rendered("dark_room", quality=CENTRES.model_copy(update={"precision": precision}))
    materials = document("dark_room")["materials"].values()
    even = {tuple(np.float32(m["ambient"] * c) for c in m["color"]) for m in materials}
    assert {tuple(color) for color in np.unique(result.image.reshape(-1, 3), axis=0)} <= even


def test_fan_of_slivers_has_no_gap() -> None:
    content = document("slivers")
    plan = renderer.compile_scene(content)
    turns, shares = np.meshgrid(np.linspace(0, 2 * math.pi, 400), np.linspace(0, 0.97, 50))
    # The widest triangle reaches cos(half its angle) of the radius where it reaches least.
    widths = np.diff(np.unwrap([math.atan2(y, x) for x, y, _ in content["shapes"][0]["vertices"][1:]]))
    reach = 1.3 * math.cos(widths.max() / 2) * shares.ravel()
    places = np.stack((reach * np.cos(turns.ravel()), reach * np.sin(turns.ravel()), 0 * reach), axis=1)
    camera, lamp = (np.array(p) for p in (content["camera"]["position"], content["lights"][0]["position"]))
    seen = renderer.trace(plan, np.broadcast_to(camera, places.shape), places - camera)
    assert set(seen.shape.tolist()) == {0}
    wall = content["shapes"][1]["corner"][2]
    behind = lamp + (places - lamp) * (wall - lamp[2]) / (0 - lamp[2])
    onto = renderer.trace(plan, behind + np.array([0, 0, 0.1]), np.broadcast_to([0.0, 0, -1], behind.shape))
    assert set(onto.shape.tolist()) == {1}
    assert onto.visibility.max() == 0


def test_first_of_two_equal_shapes() -> None:
    seen = set(np.unique(rendered("same_place", "shape").layers["shape"]))
    assert seen == {-1, 0, 2, 4, 6}


def test_giant_sphere_as_ground() -> None:
    content = document("giant_ground")
    content["shapes"][0] = rectangle([-200, 0, -200], [0, 0, 400], [400, 0, 0], material="ground")
    round_, flat = rendered("giant_ground", "depth"), rendered(content, "depth")
    # Within 40 units it falls by 40**2 / 2e7 = 8e-5, far less than a pixel: only borders may differ.
    near = (flat.layers["depth"] < 40).nonzero()
    apart = np.abs(round_.image - flat.image)[near].max(axis=-1)
    assert np.mean(apart > 1 / 255) < BORDERS


def test_critical_angle_under_water() -> None:
    content = document("critical_angle")
    ior, eye = content["materials"]["water"]["ior"], np.array(content["camera"]["position"])
    angles = math.asin(1 / ior) + np.array([-1e-3, 1e-3])
    share_of_blue = []
    for angle in angles:
        ahead = [0, math.cos(angle), -math.sin(angle)]
        narrow = {**content["camera"], "look_at": (eye + ahead).tolist(), "vertical_fov": 1e-3}
        image = rendered({**content, "camera": narrow | {"width": 3, "height": 3}}).image
        share_of_blue.append(image[..., 2] / image[..., 0])
    inside, outside = share_of_blue
    # Outside there is the bottom alone, and its light fields are the bluer ones.
    sand = content["textures"]["sand"]["even"]
    assert outside.max() <= np.float32(sand[2] / sand[0]) * (1 + 4 * np.finfo(np.float32).eps)
    assert inside.min() > outside.max() * 1.1


def test_wall_edge_on() -> None:
    content = document("grazing_floor")
    names = [shape.get("name") for shape in content["shapes"]]
    result = rendered("grazing_floor", "shape")
    assert names.index("seen from its edge") not in result.layers["shape"]
    del content["shapes"][names.index("seen from its edge")]
    darker = rendered(content).image - result.image
    assert darker.min() == 0
    assert (darker > 0.1).any()
