"""The page about grading, and what it gives to Gradescope and Classroom 50, run as these run it."""

import csv
import json
import shutil
import sys
import zipfile
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from PIL import Image

from scenes.pack_gradescope import ASSIGNMENT, CONSTRAINTS, pack
from tests.acceptance.conftest import shell, succeeds
from tests.pages import blocks, page
from tests.service.cli.conftest import COMMAND, Outcome, ended
from tests.service.grading.exports.test_json_forms import CLASSROOM50, GRADESCOPE, RUNNER

pytestmark = pytest.mark.slow

PAGE = page("how-to/grading.md")


def grey_assignment(folder: Path) -> Path:
    """An assignment with a single test, of a grey picture."""
    folder.mkdir()
    Image.new("RGB", (16, 16), "grey").save(folder / "grey.png")
    picture = {"file": "grey.png", "encoding": "srgb"}
    test: dict[str, Any] = {"id": "grey", "name": "Grey", "kind": "image", "points": 10}
    test |= {"submitted": picture, "reference": picture | {"type": "picture"}}
    manifest = {"schema": "penumbra/manifest/v1", "title": "Grey", "tests": [test]}
    # JSON is YAML too.
    (folder / "manifest.yaml").write_text(json.dumps(manifest))
    return folder


class Autograder:
    """The folder of Gradescope's container, with a package that is installed already."""

    def __init__(self, folder: Path, assignment: Path) -> None:
        self.folder, self.source, self.submission = folder, folder / "source", folder / "submission"
        self.submission.mkdir()
        wheel = folder / "penumbra_render-1-py3-none-any.whl"
        wheel.touch()
        pack(wheel, folder / "autograder.zip", assignment)
        with zipfile.ZipFile(folder / "autograder.zip") as archive:
            archive.extractall(self.source)
        command = self.source / "venv" / "bin" / "penumbra"
        command.parent.mkdir(parents=True)
        command.write_text(f'#!/bin/sh\nexec {" ".join(COMMAND)} "$@"\n')
        command.chmod(0o755)

    def run(self) -> Outcome:
        shutil.copy(self.source / "run_autograder", self.folder)
        return shell("bash run_autograder", self.folder)

    @property
    def results(self) -> Any:
        document = json.loads((self.folder / "results" / "results.json").read_text())
        jsonschema.validate(document, GRADESCOPE)
        return document


@pytest.fixture
def autograder(tmp_path: Path) -> Autograder:
    return Autograder(tmp_path, grey_assignment(tmp_path / "assignment"))


def test_page_makes_an_autograder_and_a_gradebook(checkout: Path) -> None:
    succeeds("\n".join(blocks(PAGE, "sh")), checkout)
    results = json.loads((checkout / "autograder/results/results.json").read_text())
    jsonschema.validate(results, GRADESCOPE)
    assert results["score"] == json.loads((checkout / "grade.json").read_text())["score"] == 125
    assert {test["status"] for test in results["tests"]} == {"passed"}
    with (checkout / "marks/gradebook.csv").open(newline="", encoding="utf-8-sig") as file:
        yan, zoe = csv.DictReader(file)
    assert (zoe["student"], float(zoe["score"])) == ("zoe", 125)
    # A hard shadow in place of the soft one, and nothing else.
    assert (yan["student"], float(yan["score"])) == ("yan", 0)
    assert "hard_shadows" in (checkout / "marks/students/yan/staff.html").read_text()
    assert (checkout / "graded/page.html").exists()


def test_gradescope_grades_an_empty_submission(autograder: Autograder) -> None:
    assert autograder.run().code == 0
    assert autograder.results["score"] == 0
    assert all("was not submitted" in test["output"] for test in autograder.results["tests"])


def test_gradescope_gets_no_earlier_results_by_a_broken_manifest(autograder: Autograder) -> None:
    results = autograder.folder / "results" / "results.json"
    results.parent.mkdir()
    results.write_text("{}")
    (autograder.source / "manifest.yaml").write_text("tests: []")
    done = autograder.run()
    assert done.code == 3
    assert "manifest.yaml" in done.err
    assert not results.exists()


def test_gradescope_archive_has_what_setup_installs(tmp_path: Path) -> None:
    source = Autograder(tmp_path, ASSIGNMENT).source
    succeeds("bash -n setup.sh && bash -n run_autograder && ls *.whl", source)
    (installed,) = [line for line in (source / "setup.sh").read_text().splitlines() if "pip install" in line]
    assert "--constraint constraints.txt" in installed
    assert (source / "constraints.txt").read_bytes() == CONSTRAINTS.read_bytes()
    assert (source / "references" / "shadow_soft.npz").is_file()
    assert not (source / "gradescope").exists()


def test_classroom50_script_writes_its_result(tmp_path: Path) -> None:
    bundle, student = grey_assignment(tmp_path / "bundle"), tmp_path / "student"
    student.mkdir()
    shutil.copy(bundle / "grey.png", student)
    # No submitted file may shadow the package.
    (student / "service.py").write_text("raise SystemExit('imported')")
    (script,) = blocks(PAGE, "python")
    install = next(line for line in script.splitlines() if "pip" in line)
    (bundle / "autograder.py").write_text(script.replace(install, ""))
    done = ended(student, bundle / "autograder.py", program=[sys.executable], **RUNNER)
    assert (done.code, done.out) == (0, ""), done.err
    result = json.loads((student / "result.json").read_text())
    jsonschema.validate(result, CLASSROOM50)
    assert (result["score"], result["max-score"]) == (10, 10)
