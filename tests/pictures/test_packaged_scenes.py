"""Packaged scenes: no bad pixel in any, and the hard ones look as their geometry says."""

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import renderer
import scenes
from schemas.quality import Antialiasing, FixedQuality

FOLDER = Path(scenes.__file__).parent / "hard"
PACKAGED = sorted(path for folder in ("gallery", "hard") for path in (FOLDER.parent / folder).glob("*.json"))
CENTRES = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="center", samples=1))


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


def test_first_of_two_equal_shapes() -> None:
    seen = set(np.unique(rendered("same_place", "shape").layers["shape"]))
    assert seen == {-1, 0, 2, 4, 6}


def test_wall_edge_on() -> None:
    content = document("grazing_floor")
    names = [shape.get("name") for shape in content["shapes"]]
    result = rendered("grazing_floor", "shape")
    assert names.index("seen from its edge") not in result.layers["shape"]
    del content["shapes"][names.index("seen from its edge")]
    darker = rendered(content).image - result.image
    assert darker.min() == 0
    assert (darker > 0.1).any()
