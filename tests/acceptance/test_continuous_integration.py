"""The files of docs/how-to/continuous-integration.md, run in a repository as a build runs them."""

import json
import re
import shutil
from pathlib import Path

import pytest
import yaml

from tests.acceptance.conftest import shell, shrink, succeeds
from tests.pages import page
from tests.service.cli.conftest import ROOT

pytestmark = pytest.mark.slow

PAGE = page("how-to/continuous-integration.md")
FILES = dict(re.findall(r"^`([\w./-]+)`:\n\n```\w+\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
"""Path and content of each file that the page shows."""


def job(path: str, name: str) -> str:
    """Script of a job on the page, without the installation."""
    steps = [step["run"] for step in yaml.safe_load(FILES[path])["jobs"][name]["steps"] if "run" in step]
    return "\n".join(step for step in steps if not step.startswith("pip install"))


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with all files of the page and two small scenes."""
    for path, content in FILES.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    (tmp_path / "scenes").mkdir()
    for name in ("basic", "falloff"):
        shutil.copy(ROOT / "scenes" / "gallery" / f"{name}.json", tmp_path / "scenes")
    shrink(tmp_path / "scenes")
    return tmp_path


@pytest.fixture
def with_references(repository: Path) -> Path:
    """The same after its references were made, as the page says."""
    (script,) = re.findall(r"^```sh\n(mkdir -p references\n.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    succeeds(script, repository)
    return repository


def dim(scene: Path) -> None:
    """Make all lights of a scene darker."""
    document = json.loads(scene.read_text())
    for light in document["lights"]:
        light["color"] = [0.7 * part for part in light["color"]]
    scene.write_text(json.dumps(document))


def test_build_fails_after_a_scene_has_changed(with_references: Path) -> None:
    build = job(".github/workflows/pictures.yml", "pictures")
    succeeds(build, with_references)
    dim(with_references / "scenes" / "basic.json")
    failed = shell(build, with_references)
    assert failed.code == 1, failed.out + failed.err
    # The scene after the one that failed was tried, too.
    assert re.findall(r"^(\w*match): ", failed.out, re.MULTILINE)[0] == "mismatch"
    for name in ("basic", "falloff"):
        assert (with_references / "out" / f"{name}.difference.png").exists()
    (with_references / "scenes" / "basic.json").write_text("{")
    assert shell(build, with_references).code == 3


def test_submission_passes_or_fails_by_its_points(repository: Path) -> None:
    assignment, handed_in = repository / "assignment", repository / "handed-in"
    shutil.copytree(ROOT / "scenes" / "assignment", assignment)
    shutil.copytree(assignment / "references", handed_in)
    summary = repository / "step-summary"
    build = job(".github/workflows/grade.yml", "grade")
    succeeds(build, repository, GITHUB_STEP_SUMMARY=str(summary))
    for picture in handed_in.glob("shadow_*.png"):
        picture.unlink()
    failed = shell(build, repository, GITHUB_STEP_SUMMARY=str(summary))
    assert failed.code == 1, failed.out + failed.err
    assert "shadow" in (repository / "grade.xml").read_text()
    assert "shadow" in summary.read_text().lower()
