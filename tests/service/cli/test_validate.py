import json
from pathlib import Path
from typing import Any

from tests.service.cli.conftest import Penumbra


def test_errors_show_their_lines(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][1]["material"] = "flor"
    broken = scene_file.with_name("broken.json")
    broken.write_text(json.dumps(scene, indent=2))
    outcome = here("validate", scene_file, broken)
    assert outcome.code == 3
    lines = outcome.out.splitlines()
    assert lines[:2] == [f"{scene_file}: ok", f"{broken}: 2 errors"]
    shown = [line.partition("| ")[2].strip() for line in lines if "| " in line]
    assert shown == ['"vertical_fov": 180,', "^", '"material": "flor"', "^"]
    assert "'floor'" in outcome.out
    fine, finding = here("validate", scene_file, broken, "--json").document["files"]
    assert fine["errors"] == []
    places = {error["pointer"]: (error["line"], error["column"]) for error in finding["errors"]}
    line, column = places["/camera/vertical_fov"]
    assert broken.read_text().splitlines()[line - 1][column - 1 :] == "180,"


def test_warning_is_no_failure(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    del scene["lights"]
    scene_file.write_text(json.dumps(scene, indent=2))
    outcome = here("validate", scene_file)
    assert outcome.code == 0
    assert outcome.out.splitlines()[0] == f"{scene_file}: 1 warning"
    document = here("validate", scene_file, "--json").document
    assert document["valid"]
    assert len(document["files"][0]["warnings"]) == 1
    rendered = here("render", scene_file, "-o", "a.png", "--workers", 1, "--json")
    assert rendered.document["rays"].get("shadow", 0) == 0
    assert "warning" in rendered.err


def test_scene_from_stdin(here: Penumbra, scene: dict[str, Any]) -> None:
    assert here("validate", "-", stdin=json.dumps(scene)).code == 0
    assert here("validate", "-", stdin="{").code == 3


def test_file_beyond_the_limit(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_bytes(b'{"name": "' + b"x" * (16 << 20) + b'\xff"}')
    outcome = here("validate", "scene.json")
    assert outcome.code == 3
    assert "16777216" in outcome.out
