"""The page about grading, followed step by step."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
from PIL import Image

from tests.acceptance.conftest import ENVIRONMENT, ROOT, shell
from tests.pages import blocks, page
from tests.service.grading.exports.test_json_forms import CLASSROOM50, GRADESCOPE, RUNNER

pytestmark = pytest.mark.slow

PAGE = page("how-to/grading.md")


def test_page_makes_an_autograder_and_a_gradebook(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    shutil.copy(ROOT / "constraints.txt", tmp_path)
    (tmp_path / "dist").mkdir()
    (tmp_path / "dist" / "penumbra_render-1-py3-none-any.whl").touch()
    shell("\n".join(blocks(PAGE, "sh")), tmp_path, timeout=550)
    results = json.loads((tmp_path / "autograder/results/results.json").read_text())
    jsonschema.validate(results, GRADESCOPE)
    assert results["score"] == json.loads((tmp_path / "grade.json").read_text())["score"] == 125
    assert {test["status"] for test in results["tests"]} == {"passed"}
    with (tmp_path / "marks/gradebook.csv").open(newline="", encoding="utf-8-sig") as file:
        yan, zoe = csv.DictReader(file)
    assert (zoe["student"], float(zoe["score"])) == ("zoe", 125)
    # A hard shadow in place of the soft one, and nothing else.
    assert (yan["student"], float(yan["score"])) == ("yan", 0)
    assert "hard_shadows" in (tmp_path / "marks/students/yan/staff.html").read_text()
    assert (tmp_path / "graded/page.html").exists()


def test_classroom50_script_writes_its_result(tmp_path: Path) -> None:
    bundle, student = tmp_path / "bundle", tmp_path / "student"
    bundle.mkdir()
    student.mkdir()
    Image.new("RGB", (16, 16), "grey").save(bundle / "grey.png")
    shutil.copy(bundle / "grey.png", student)
    # No submitted file may shadow the package.
    (student / "service.py").write_text("raise SystemExit('imported')")
    picture = {"file": "grey.png", "encoding": "srgb"}
    test = {"id": "grey", "name": "Grey", "kind": "image", "points": 10, "submitted": picture}
    manifest = {
        "schema": "penumbra/manifest/v1",
        "title": "Grey",
        "tests": [test | {"reference": picture | {"type": "picture"}}],
    }
    (bundle / "manifest.yaml").write_text(json.dumps(manifest))
    (script,) = blocks(PAGE, "python")
    install = next(line for line in script.splitlines() if "pip" in line)
    (bundle / "autograder.py").write_text(script.replace(install, ""))
    done = subprocess.run(
        [sys.executable, str(bundle / "autograder.py")],
        cwd=student,
        env=ENVIRONMENT | RUNNER,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    result = json.loads((student / "result.json").read_text())
    jsonschema.validate(result, CLASSROOM50)
    assert (result["score"], result["max-score"]) == (10, 10)
