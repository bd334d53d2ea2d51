"""The archive for Gradescope, run as Gradescope runs it: scripts in /autograder, without arguments."""

from __future__ import annotations

import json
import shutil
import stat
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from PIL import Image

from scenes.pack_gradescope import ASSIGNMENT, CONSTRAINTS, pack
from tests.acceptance.conftest import COMMAND, ENVIRONMENT
from tests.service.grading.exports.test_json_forms import GRADESCOPE

pytestmark = pytest.mark.slow


class Autograder:
    """The folder of Gradescope's container, with a package that is installed already."""

    def __init__(self, folder: Path, assignment: Path = ASSIGNMENT) -> None:
        self.folder = folder
        self.submission = folder / "submission"
        self.submission.mkdir()
        wheel = folder / "penumbra_render-1-py3-none-any.whl"
        wheel.touch()
        pack(wheel, folder / "autograder.zip", assignment)
        with zipfile.ZipFile(folder / "autograder.zip") as archive:
            archive.extractall(folder / "source")
        command = folder / "source" / "venv" / "bin" / "penumbra"
        command.parent.mkdir(parents=True)
        command.write_text(f'#!/bin/sh\nexec {" ".join(COMMAND)} "$@"\n')
        command.chmod(stat.S_IRWXU)

    def run(self) -> subprocess.CompletedProcess[str]:
        shutil.copy(self.folder / "source" / "run_autograder", self.folder)
        return subprocess.run(
            ["bash", "run_autograder"],
            cwd=self.folder,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )

    @property
    def results(self) -> Any:
        document = json.loads((self.folder / "results" / "results.json").read_text())
        jsonschema.validate(document, GRADESCOPE)
        return document


@pytest.fixture
def autograder(tmp_path: Path) -> Autograder:
    """One with a single test, of a grey picture."""
    assignment = tmp_path / "assignment"
    assignment.mkdir()
    Image.new("RGB", (16, 16), "grey").save(assignment / "grey.png")
    picture = {"file": "grey.png", "encoding": "srgb"}
    test: dict[str, Any] = {"id": "grey", "name": "Grey", "kind": "image", "points": 10}
    test |= {"submitted": picture, "reference": picture | {"type": "picture"}}
    manifest = {"schema": "penumbra/manifest/v1", "title": "Grey", "tests": [test]}
    # JSON is YAML too.
    (assignment / "manifest.yaml").write_text(json.dumps(manifest))
    return Autograder(tmp_path, assignment)


def test_empty_submission_is_graded(autograder: Autograder) -> None:
    done = autograder.run()
    assert done.returncode == 0, done.stderr
    assert autograder.results["score"] == 0
    assert all("was not submitted" in test["output"] for test in autograder.results["tests"])


def test_unreadable_submission_has_no_scores(autograder: Autograder) -> None:
    (autograder.submission / "grey.png").write_bytes(b"not what it says")
    done = autograder.run()
    assert done.returncode == 0, done.stderr
    assert autograder.results["output"].startswith("Nothing could be graded")
    assert all("score" not in test for test in autograder.results["tests"])


def test_broken_manifest_leaves_no_earlier_results(autograder: Autograder) -> None:
    (autograder.folder / "results").mkdir()
    (autograder.folder / "results" / "results.json").write_text("{}")
    (autograder.folder / "source" / "manifest.yaml").write_text("tests: []")
    done = autograder.run()
    assert done.returncode == 3
    assert "manifest.yaml" in done.stderr
    assert not (autograder.folder / "results" / "results.json").exists()


def test_archive_has_what_setup_installs(tmp_path: Path) -> None:
    source = Autograder(tmp_path).folder / "source"
    for script in ("setup.sh", "run_autograder"):
        subprocess.run(["bash", "-n", str(source / script)], check=True)
    assert len(list(source.glob("*.whl"))) == 1
    (installed,) = [line for line in (source / "setup.sh").read_text().splitlines() if "pip install" in line]
    assert "--constraint constraints.txt" in installed
    assert (source / "constraints.txt").read_bytes() == CONSTRAINTS.read_bytes()
    assert (source / "references" / "shadow_soft.npz").is_file()
    assert not (source / "gradescope").exists()
