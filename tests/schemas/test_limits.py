"""Limits are the same wherever a scene is read, and raised in the same way."""

import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
import schemas
from accuracy.comparison import NotComparableError, assert_render_close
from renderer.images.files import encode_png
from schemas.errors import SceneError
from schemas.limits import Limits, LimitsError, limits_in_force, variable_of
from schemas.quality import FixedQuality
from schemas.scene import Display
from tests.documents import scene as empty_scene

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "limits.md"

MESH = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]] * 3}
FEW: dict[str, tuple[int, str]] = {
    "max_body_bytes": (100, ""),
    "max_depth": (2, ""),
    "max_values": (5, ""),
    "max_members": (3, ""),
    "max_shapes": (1, "/shapes"),
    "max_triangles": (2, "/shapes/2/triangles"),
    "max_lights": (1, "/lights"),
    "max_materials": (1, "/materials"),
    "max_textures": (1, "/textures"),
    "max_pixels": (15, "/camera/height"),
    "max_samples": (3, "/sampling/antialiasing/samples"),
    "max_light_samples": (3, "/sampling/light/samples"),
    "max_mesh_triangles": (2, "/shapes/2/triangles"),
    "max_image_pixels": (3, "/textures/wood/asset"),
}
TEXT_ALONE = {"max_body_bytes", "max_values", "max_members"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene with everything that has a limit, and its texture of four pixels."""
    phong = {"type": "phong", "color_texture": "wood"}
    document = empty_scene(
        *({"type": "ellipsoid", "center": [0, 0, z], "radius": 1, "material": "a"} for z in range(2)),
        MESH | {"material": "a"},
        textures={name: {"type": "image", "asset": "wood.png"} for name in ("wood", "bark")},
        materials=dict.fromkeys(("a", "b"), phong),
        lights=[{"type": "point", "position": [x, 9, 9], "color": [1, 1, 1]} for x in range(2)],
        sampling={"antialiasing": {"samples": 4}, "light": {"samples": 4}},
    )
    document["camera"] |= {"width": 4, "height": 4}
    (tmp_path / "scene.json").write_text(json.dumps(document))
    (tmp_path / "wood.png").write_bytes(encode_png(np.ones((2, 2, 3)), Display()))
    return tmp_path


def problems_of(source: Any, limits: Limits | None = None, **options: Any) -> list[schemas.Problem]:
    try:
        renderer.compile_scene(renderer.load_scene(source, limits=limits, **options))
    except SceneError as error:
        return list(error.errors)
    return []


@pytest.mark.parametrize("limit", FEW)
def test_limit_names_its_variable(limit: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, (few, pointer) = folder / "scene.json", FEW[limit]
    (problem,) = problems_of(path, Limits(**{limit: few}))
    named = re.findall(r"PENUMBRA_\w+", problem.detail)
    assert (problem.pointer, named) == (pointer, [variable_of(limit)])
    monkeypatch.setenv(named[0], str(few))
    assert problems_of(path) == [problem]
    monkeypatch.setenv(named[0], str(few * 1000))
    assert problems_of(path) == []


@pytest.mark.parametrize("limit", FEW)
def test_limits_of_a_dict(limit: str, folder: Path) -> None:
    document = json.loads((folder / "scene.json").read_text())
    found = problems_of(document, Limits(**{limit: FEW[limit][0]}), assets=folder)
    assert [problem.pointer for problem in found] == ([] if limit in TEXT_ALONE else [FEW[limit][1]])


def test_limits_on_the_page() -> None:
    rows = dict(re.findall(r"^\| `(max_\w+)` \| (\d+) \|", PAGE.read_text(), re.MULTILINE))
    assert FEW.keys() == asdict(Limits()).keys()
    assert {name: int(value) for name, value in rows.items()} == asdict(Limits()) | {
        "max_trace_rays": 100_000,
        "max_cpu_seconds": 3600,
    }


def test_quality_beyond_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    requested = {"antialiasing": {"pattern": "random", "samples": 5000}}
    with pytest.raises(SceneError, match="PENUMBRA_LIMITS__MAX_SAMPLES raises this limit"):
        renderer.compile_scene(empty_scene(), requested)
    monkeypatch.setenv("PENUMBRA_LIMITS__MAX_SAMPLES", "5000")
    assert renderer.compile_scene(empty_scene(), requested).quality == FixedQuality.model_validate(requested)


def test_compared_pictures_beyond_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.zeros((4, 4, 3), np.float32)
    content = encode_png(picture, Display())
    assert assert_render_close(content, content).passed
    monkeypatch.setenv("PENUMBRA_LIMITS__MAX_IMAGE_PIXELS", "15")
    with pytest.raises(NotComparableError, match="PENUMBRA_LIMITS__MAX_IMAGE_PIXELS raises this limit"):
        assert_render_close(content, content)


@pytest.mark.parametrize(
    ("variable", "text", "said"),
    [
        ("PENUMBRA_LIMITS__MAX_PIXLES", "1", "names no limit"),
        ("PENUMBRA_LIMITS__MAX_PIXELS", "many", "must be a whole number, 1 or more, not 'many'"),
        ("PENUMBRA_LIMITS__MAX_PIXELS", "-1", "must be a whole number"),
        ("penumbra_limits__max_pixels", "1.5", "must be a whole number"),
    ],
)
def test_invalid_variable_is_refused(variable: str, text: str, said: str) -> None:
    with pytest.raises(LimitsError, match=f"{variable} {said}"):
        limits_in_force({variable: text})


@pytest.mark.parametrize("value", [0, -1, 1.5, True, "2", None], ids=repr)
def test_invalid_limit_is_refused(value: Any) -> None:
    with pytest.raises(LimitsError, match="max_pixels must be a whole number"):
        Limits(max_pixels=value)
