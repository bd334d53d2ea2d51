"""Files that a scene names: where they may come from."""

import json
import os
from pathlib import Path

import pytest

import renderer
from renderer.assets import FolderAssets
from tests.documents import phong, rectangle, scene
from tests.pictures.parts import Files

TEXTURED = scene(
    rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0]),
    textures={"a/b": {"type": "image", "asset": "picture.png"}},
    materials={"plain": phong(color_texture="a/b")},
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    inside = tmp_path / "scenes"
    (inside / "below").mkdir(parents=True)
    (tmp_path / "secret.png").write_bytes(b"secret")
    (inside / "a.png").write_bytes(b"a")
    (inside / "below" / "b.png").write_bytes(b"b")
    (inside / "out.png").symlink_to(tmp_path / "secret.png")
    (inside / "away").symlink_to(tmp_path)
    (inside / "in.png").symlink_to(inside / "a.png")
    (inside / "loop.png").symlink_to(inside / "loop.png")
    os.mkfifo(inside / "pipe.png")
    return inside


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.png", b"a"), ("below/b.png", b"b"), ("./below/../a.png", b"a"), ("in.png", b"a")],
)
def test_files_in_the_folder_are_read(folder: Path, tmp_path: Path, name: str, content: bytes) -> None:
    assert FolderAssets(folder).read(name) == content
    (tmp_path / "door").symlink_to(folder)
    assert FolderAssets(tmp_path / "door").read(name) == content


@pytest.mark.parametrize(
    "name",
    ["../secret.png", "below/../../secret.png", "out.png", "away/secret.png", "/etc/passwd", "~/secret.png",
     "nowhere.png", "below", ".", "", "loop.png", "pipe.png", "a.png/b.png", "x" * 1000, "a\0.png",
     "\ud800.png", "http://localhost/a.png", "SECRET.png", "Out.png", "AWAY/secret.png", "../Secret.png"],
)  # fmt: skip
def test_files_elsewhere_are_not_read(folder: Path, name: str) -> None:
    """Outside, a link that leads out, a folder, a pipe, an impossible name; nor is one suggested."""
    with pytest.raises(KeyError) as caught:
        FolderAssets(folder).read(name)
    assert "Did you mean" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("../secret.png", ".."),
        ("/etc/passwd", "absolute"),
        ("out.png", "symbolic link"),
        ("below", "folder"),
        ("http://localhost/a.png", "fetched"),
        ("below\\b.png", "'/'"),
        ("A.PNG", "'a.png'?"),
        ("Below/B.png", "'below/b.png'?"),
        ("C:\\scenes\\below\\b.png", "'below/b.png'?"),
        ("textures/a.png", "'a.png'?"),
        ("/pictures/a.png", "'a.png'?"),
        ("../A.PNG", "'a.png'?"),
        ("sha256:" + "0" * 64, "uploaded"),
    ],
)
def test_file_that_is_not_read_is_a_problem_with_a_reason(folder: Path, name: str, said: str) -> None:
    scene = json.loads(json.dumps(TEXTURED).replace("picture.png", name.replace("\\", "\\\\")))
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(scene, assets=FolderAssets(folder)))
    (problem,) = caught.value.errors
    assert problem.pointer == "/textures/a~1b/asset"
    assert said in problem.detail


@pytest.mark.parametrize("files", [{}, {"picture.png": b"text"}], ids=["missing", "no picture"])
def test_file_that_is_unusable_is_a_problem_of_the_scene(files: dict[str, bytes]) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(TEXTURED, assets=Files(files)))
    assert [(each.pointer, each.code) for each in caught.value.errors] == [("/textures/a~1b/asset", "asset")]
