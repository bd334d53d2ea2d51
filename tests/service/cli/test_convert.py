import json
from pathlib import Path

import pytest

from tests.service.cli.conftest import Penumbra
from tests.service.converting.conftest import TRIANGLE, course

TWO_MATERIALS = b"usemtl a\n" + TRIANGLE + b"usemtl b\nf 1 3 2\n"


def test_converted_scene_renders(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "left.obj").write_bytes(TRIANGLE)
    box = course(nurbs=[], image_resolution=[8, 8], spp=1)
    box["cam_config"]["ref_up"] = [0, 0, 1]
    text = json.dumps(box, indent=1)
    (tmp_path / "box.json").write_text(text)
    outcome = here("convert", "box.json", "-o", "scene.json")
    assert (outcome.code, outcome.out) == (0, "")
    lines = outcome.err.splitlines()
    number = text.splitlines().index(' "nurbs": []') + 1
    assert f"  left out box.json line {number}: /nurbs" in lines
    assert any(line.startswith("  assumed box.json line ") for line in lines)
    assert "/camera/up" in outcome.err
    document = here("convert", "box.json", "-o", "scene.json", "--json").document
    assert document["scene"] == json.loads((tmp_path / "scene.json").read_text())
    assert {"kind", "file", "place", "line", "detail"} == set(document["assumptions"][0])
    assert here("render", "scene.json", "-o", "picture.png", "--workers", 1).code == 0


def test_meshes_beside_the_scene(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "in" / "mesh.obj").write_bytes(TWO_MATERIALS)
    outcome = here("convert", "in/mesh.obj", "-o", "out/scene.json")
    assert outcome.code == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["mesh-a.obj", "mesh-b.obj", "scene.json"]
    assert here("validate", "out/scene.json").code == 0


@pytest.mark.parametrize(
    ("words", "code", "reported"),
    [
        (("mesh.obj", "-o", "scene.json"), 3, "3 | f 1 2 3"),
        (("gone.obj", "-o", "scene.json"), 3, "gone.obj"),
        (("mesh.obj", "-o", "scene.txt"), 2, ".json"),
        (("mesh.obj",), 2, "-o"),
    ],
)
def test_unusable_arguments(
    here: Penumbra, tmp_path: Path, words: tuple[str, ...], code: int, reported: str
) -> None:
    (tmp_path / "mesh.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nf 1 2 3\n")
    outcome = here("convert", *words)
    assert outcome.code == code
    assert reported in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.obj"]
