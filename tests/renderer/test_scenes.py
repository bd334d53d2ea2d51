"""Scenes from wherever they are."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import phong, rectangle, scene
from schemas.reading import read_scene
from tests.pictures.parts import Files, png

SCENE = scene(
    rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0]),
    textures={"t": {"type": "image", "asset": "pictures/t.png"}},
    materials={"plain": phong(color_texture="t")},
)
PICTURE = png(np.full((1, 1, 3), 200, np.uint8))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "t.png").write_bytes(PICTURE)
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    return tmp_path / "scene.json"


def test_scene_from_any_source(path: Path) -> None:
    model, _ = read_scene(SCENE)
    content = json.dumps(SCENE).encode()
    for source in (path, str(path), content, SCENE, model):
        assert renderer.load_scene(source).document == model
    loaded = renderer.load_scene(path)
    assert renderer.load_scene(loaded) is loaded


def test_files_beside_a_path(
    path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not from where the program runs."""
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    expected = renderer.render(
        renderer.compile_scene(renderer.load_scene(SCENE, assets=Files({"pictures/t.png": PICTURE})))
    )
    assert (renderer.render(renderer.compile_scene(path)).image == expected.image).all()


def test_source_of_files(path: Path) -> None:
    loaded = renderer.load_scene(path, assets=Files())
    with pytest.raises(renderer.SceneError, match="no such file"):
        renderer.compile_scene(loaded)


@pytest.mark.parametrize("source", [b"", b"{}", b"[1]", {"version": 1}, b'{"version": NaN}', b"\xff"])
def test_invalid_scene_lists_its_problems(source: Any) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.load_scene(source)
    assert caught.value.errors
    assert all(problem.detail for problem in caught.value.errors)


def test_warnings_of_a_scene() -> None:
    warned = renderer.load_scene(scene(materials={"spare": phong()}))
    assert "/materials/spare" in [problem.pointer for problem in warned.warnings]
