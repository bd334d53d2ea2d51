"""Loading a scene from a path, bytes, a dict or a model, with its files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from schemas.limits import Limits
from schemas.reading import read_scene
from tests.documents import phong, rectangle, scene
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


def test_scene_is_the_same_from_every_source(path: Path) -> None:
    model, _ = read_scene(SCENE)
    for source in (path, str(path), json.dumps(SCENE).encode(), SCENE, model):
        assert renderer.load_scene(source).document == model
    loaded = renderer.load_scene(path)
    assert renderer.load_scene(loaded) is loaded


def test_files_come_from_the_folder_of_the_scene(
    path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not from where the program runs."""
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    given = renderer.load_scene(SCENE, assets=Files({"pictures/t.png": PICTURE}))
    images = [renderer.render(renderer.compile_scene(each)).image for each in (path, given)]
    assert np.array_equal(*images)


def test_files_given_replace_the_folder(path: Path, tmp_path: Path) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(path, assets=Files()))
    assert [problem.pointer for problem in caught.value.errors] == ["/textures/t/asset"]
    (tmp_path / "a").write_bytes(b"one")
    for folder in (tmp_path, str(tmp_path)):
        assert renderer.load_scene(renderer.load_scene(SCENE), assets=folder).assets.read("a") == b"one"
    with pytest.raises(NotADirectoryError):
        renderer.load_scene(SCENE, assets=tmp_path / "a")
    with pytest.raises(TypeError, match="dict"):
        renderer.load_scene(SCENE, assets={"a": b""})  # type: ignore[arg-type]


@pytest.mark.parametrize("source", [b"", b"{}", b"[1]", {"version": 1}, b'{"version": NaN}', b"\xff"])
def test_scene_that_is_invalid_lists_its_problems(source: Any) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.load_scene(source)
    assert caught.value.errors
    assert all(problem.detail for problem in caught.value.errors)


@pytest.mark.parametrize("source", [None, 5, ["scene.json"], 1j], ids=repr)
def test_scene_of_a_wrong_type_is_refused(source: Any) -> None:
    with pytest.raises(TypeError, match=f"not {type(source).__name__}"):
        renderer.load_scene(source)


def test_scene_text_is_not_taken_for_a_path(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"text.encode\(\)"):
        renderer.load_scene("\n" + json.dumps(SCENE))
    with pytest.raises(FileNotFoundError):
        renderer.load_scene(tmp_path / "nowhere.json")


def test_warnings_are_kept_with_the_scene() -> None:
    warned = renderer.load_scene(scene(materials={"spare": phong()}))
    assert "/materials/spare" in [problem.pointer for problem in warned.warnings]


def test_limits_are_those_of_the_caller() -> None:
    with pytest.raises(renderer.SceneError, match="10"):
        renderer.load_scene(scene(materials={}), limits=Limits(max_pixels=10))
    for limits in (5, {"max_pixels": 3}):
        with pytest.raises(TypeError, match=f"not {type(limits).__name__}"):
            renderer.load_scene(SCENE, limits=limits)  # type: ignore[arg-type]
