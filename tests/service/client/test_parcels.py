import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from schemas.errors import Problem, SceneError
from service.client.parcels import pack


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.png").write_bytes(b"one")
    (tmp_path / "b.png").write_bytes(b"one")
    (tmp_path / "c.png").write_bytes(b"two")
    return tmp_path


def _scene(**assets: str) -> dict[str, Any]:
    return {"version": 1, "textures": {key: {"type": "image", "asset": name} for key, name in assets.items()}}


def _file(folder: Path, scene: dict[str, Any]) -> Path:
    path = folder / "scene.json"
    path.write_text(json.dumps(scene, indent=2))
    return path


def test_textures_are_named_by_content(folder: Path) -> None:
    parcel = pack(_file(folder, _scene(x="a.png", y="b.png", z="c.png")))
    one, two = (hashlib.sha256(content).hexdigest() for content in (b"one", b"two"))
    assert parcel.contents == {one: b"one", two: b"two"}
    assert parcel.document == _scene(x=f"sha256:{one}", y=f"sha256:{one}", z=f"sha256:{two}")


@pytest.mark.parametrize("name", ["missing.png", "../outside.png", "/etc/hostname", ""])
def test_missing_file_has_its_line(folder: Path, name: str) -> None:
    (folder.parent / "outside.png").write_bytes(b"secret")
    path = _file(folder, _scene(x="a.png", y=name))
    with pytest.raises(SceneError) as caught:
        pack(path)
    (problem,) = caught.value.errors
    assert problem.pointer == "/textures/y/asset"
    assert problem.line is not None
    assert f'"asset": {json.dumps(name)}' in path.read_text().splitlines()[problem.line - 1]


@pytest.mark.parametrize(
    ("text", "code"), [(b"{", "not_json"), (b"[]", "not_an_object"), (b'{"a": 1, "a": 2}', "duplicate_field")]
)
def test_unsendable_scene_is_refused(text: bytes, code: str) -> None:
    with pytest.raises(SceneError) as caught:
        pack(text)
    assert [problem.code for problem in caught.value.errors] == [code]


def test_problems_point_into_the_file() -> None:
    text = b'{"version": 1,\n "a/b": {"c": [1,\n  2]}}'
    parcel = pack(text)
    sent = [
        Problem(pointer="/scene/a~1b/c/1", detail="", code="x", line=1, column=99),
        Problem(pointer="/scene/a~1b", detail="", code="unknown_field", line=1, column=9),
        Problem(pointer="/quality/mode", detail="", code="x", line=1, column=7),
    ]
    placed = [(problem.pointer, problem.line, problem.column) for problem in parcel.placed(sent)]
    assert placed == [("/a~1b/c/1", 3, 3), ("/a~1b", 2, 2), ("/quality/mode", None, None)]


def test_meshes_are_sent_along(folder: Path) -> None:
    scene = _scene(x="a.png") | {"shapes": [{"type": "sphere"}, {"type": "mesh", "asset": "c.png"}, 3]}
    path = _file(folder, scene)
    one, two = (hashlib.sha256(content).hexdigest() for content in (b"one", b"two"))
    parcel = pack(path)
    assert parcel.contents == {one: b"one", two: b"two"}
    assert parcel.document["shapes"] == [{"type": "sphere"}, {"type": "mesh", "asset": f"sha256:{two}"}, 3]
    with pytest.raises(SceneError) as caught:
        pack(scene)
    assert [problem.pointer for problem in caught.value.errors] == ["/textures/x/asset", "/shapes/1/asset"]
    assert scene["shapes"][1] == {"type": "mesh", "asset": "c.png"}
