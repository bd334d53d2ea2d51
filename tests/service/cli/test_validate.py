from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.cli.main import main
from tests.service.cli.conftest import Penumbra


def test_errors_show_their_lines(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][1]["material"] = "flor"
    broken = scene_file.with_name("broken.json")
    broken.write_text(json.dumps(scene, indent=2))
    outcome = here("validate", scene_file, broken)
    assert outcome.code == 3
    lines = outcome.out.splitlines()
    assert lines[0] == f"{scene_file}: ok"
    assert lines[1] == f"{broken}: 2 errors"
    shown = [line.partition("| ")[2].strip() for line in lines if "| " in line]
    assert shown == ['"vertical_fov": 180,', "^", '"material": "flor"', "^"]
    assert "'floor'" in outcome.out


def test_json_document(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    scene["camera"]["up"] = [0, 0, 0]
    scene_file.write_text(json.dumps(scene))
    document = here("validate", scene_file, "--json").document
    (finding,) = document["files"]
    assert not document["valid"]
    assert [error["pointer"] for error in finding["errors"]] == ["/camera/up"]
    assert scene_file.read_text()[finding["errors"][0]["column"] - 1 :].startswith("[0, 0, 0]")


def test_warning_is_no_failure(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    del scene["lights"]
    scene_file.write_text(json.dumps(scene, indent=2))
    outcome = here("validate", scene_file)
    assert outcome.code == 0
    assert outcome.out.splitlines()[0] == f"{scene_file}: 1 warning"
    document = here("validate", scene_file, "--json").document
    assert document["valid"]
    assert len(document["files"][0]["warnings"]) == 1


def test_scene_from_stdin(here: Penumbra, scene: dict[str, Any]) -> None:
    assert here("validate", "-", stdin=json.dumps(scene)).code == 0
    assert here("validate", "-", stdin="{").code == 3


def test_texture_outside_the_folder(
    here: Penumbra, scene: dict[str, Any], scene_file: Path, tmp_path: Path
) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.png").write_bytes(b"secret")
    scene["textures"] = {"wood": {"type": "image", "asset": "../secret.png"}}
    scene["materials"]["floor"] = {"type": "phong", "color_texture": "wood"}
    (inner / "scene.json").write_text(json.dumps(scene))
    for words in (["validate"], ["submit", "--server", "http://127.0.0.1:9"]):
        outcome = here(*words, inner / "scene.json")
        assert outcome.code == 3
        assert "/textures/wood/asset" in outcome.out + outcome.err


@pytest.mark.parametrize(
    ("content", "detail"),
    [
        (b"", "empty"),
        (b"[" * 100_000, "nested more than 64 deep"),
        (b'{"name": "' + b"x" * (16 << 20) + b'\xff"}', "16777216"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "PNG picture"),
        (b"\xff\xfe{\x00", "UTF-16"),
        (b"\x00\xff", "UTF-8"),
    ],
    ids=["empty", "deep", "large", "picture", "UTF-16", "binary"],
)
def test_file_that_is_no_document(here: Penumbra, tmp_path: Path, content: bytes, detail: str) -> None:
    path = tmp_path / "scene.json"
    path.write_bytes(content)
    for command in (["validate", path], ["render", path, "-o", "x.png"]):
        outcome = here(*command)
        assert outcome.code == 3
        assert detail in outcome.out + outcome.err
        assert "Traceback" not in outcome.err


def test_limits_from_the_environment(
    scene_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    outcomes = []
    for value in ("100", "many", "10000"):
        monkeypatch.setenv("PENUMBRA_LIMITS__MAX_PIXELS", value)
        with pytest.raises(SystemExit) as left:
            main(["validate", str(scene_file)])
        outcomes.append((left.value.code, "".join(capsys.readouterr())))
    assert [code for code, _ in outcomes] == [3, 2, 0]
    assert all("PENUMBRA_LIMITS__MAX_PIXELS" in found for _, found in outcomes[:2])
    assert "'many'" in outcomes[1][1]
