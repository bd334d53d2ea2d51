from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.service.cli.conftest import Penumbra
from tests.service.converting.conftest import TRIANGLE, course

TWO_MATERIALS = b"usemtl a\n" + TRIANGLE + b"usemtl b\nf 1 3 2\n"


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """A course scene with its mesh."""
    (tmp_path / "left.obj").write_bytes(TRIANGLE)
    path = tmp_path / "box.json"
    path.write_text(json.dumps(course(nurbs=[], image_resolution=[8, 8], spp=1), indent=1))
    return path


def test_converted_scene_renders(here: Penumbra, tmp_path: Path, box: Path) -> None:
    outcome = here("convert", box, "-o", "scene.json")
    assert outcome.code == 0
    assert outcome.out == ""
    assert here("validate", "scene.json").out.splitlines() == ["scene.json: ok"]
    assert here("render", "scene.json", "-o", "picture.png").code == 0
    assert (tmp_path / "picture.png").stat().st_size > 0


def test_assumptions_on_stderr(here: Penumbra, box: Path) -> None:
    lines = here("convert", box, "-o", "scene.json").err.splitlines()
    number = box.read_text().splitlines().index(' "nurbs": []') + 1
    assert f"  left out box.json line {number}: /nurbs" in lines
    assert any(line.startswith("  assumed box.json line ") for line in lines)
    assert lines[-1].endswith("1 shape, 1 material, 1 light")
    assert max(map(len, lines)) <= 80


def test_json_document(here: Penumbra, tmp_path: Path, box: Path) -> None:
    document = here("convert", box, "-o", "scene.json", "--json").document
    assert document["scene"] == json.loads((tmp_path / "scene.json").read_text())
    assert document["format"] == "CS171 scene"
    assert {"kind", "file", "place", "line", "detail"} == set(document["assumptions"][0])
    assert "/nurbs" in {assumption["place"] for assumption in document["assumptions"]}


def test_meshes_beside_the_scene(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "in" / "mesh.obj").write_bytes(TWO_MATERIALS)
    outcome = here("convert", "in/mesh.obj", "-o", "out/scene.json")
    assert outcome.code == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "mesh-a.obj",
        "mesh-b.obj",
        "scene.json",
    ]
    assert "mesh-a.obj, mesh-b.obj" in outcome.err
    assert here("validate", "out/scene.json").code == 0


def test_unusable_input_shows_its_line(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "mesh.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nf 1 2 3\n")
    outcome = here("convert", "mesh.obj", "-o", "scene.json")
    assert outcome.code == 3
    assert "3 | f 1 2 3" in outcome.err
    assert not (tmp_path / "scene.json").exists()


@pytest.mark.parametrize(
    ("words", "code"),
    [(("gone.obj", "-o", "scene.json"), 3), (("gone.obj", "-o", "scene.txt"), 2), (("gone.obj",), 2)],
)
def test_exit_codes(here: Penumbra, words: tuple[str, ...], code: int) -> None:
    assert here("convert", *words).code == code


def test_scene_warnings(here: Penumbra, box: Path) -> None:
    document = json.loads(box.read_text())
    document["cam_config"]["ref_up"] = [0, 0, 1]
    box.write_text(json.dumps(document))
    outcome = here("convert", box, "-o", "scene.json")
    assert "About scene.json:" in outcome.err
    assert "/camera/up" in outcome.err
