"""The files of docs/how-to/continuous-integration.md, run in a repository as a build runs them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.acceptance.conftest import ENVIRONMENT, ROOT
from tests.acceptance.test_documentation import reduce
from tests.pages import page

PAGE = page("how-to/continuous-integration.md")
FILES = re.findall(r"^`([\w./-]+)`:\n\n```\w+\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
"""Path and content of each file that the page shows."""

pytestmark = pytest.mark.slow


def jobs() -> dict[tuple[str, str], str]:
    """What each job of the page runs after the installation, by file and name of the job."""
    found: dict[tuple[str, str], str] = {}
    for path, content in FILES:
        if not path.endswith(".yml"):
            continue
        document: dict[str, Any] = yaml.safe_load(content)
        for name, job in document.get("jobs", document).items():
            steps = job.get("script") or [step["run"] for step in job["steps"] if "run" in step]
            commands = [step for step in steps if not step.startswith("pip install")]
            found[path, name] = "\n".join(commands)
    return found


JOBS = jobs()
PICTURES = (".github/workflows/pictures.yml", "pictures")
GRADES = [(".github/workflows/grade.yml", "grade"), (".gitlab-ci.yml", "grade")]


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with all files of the page and two small scenes."""
    for path, content in FILES:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    (tmp_path / "scenes").mkdir()
    for name in ("basic", "falloff"):
        shutil.copy(ROOT / "scenes" / "gallery" / f"{name}.json", tmp_path / "scenes")
    reduce(tmp_path / "scenes")
    return tmp_path


def execute(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run commands as a build does: the first that fails ends them."""
    summary = {"GITHUB_STEP_SUMMARY": str(folder / "step-summary")}
    return subprocess.run(
        ["bash", "-e", "-c", script],
        capture_output=True,
        text=True,
        cwd=folder,
        env=ENVIRONMENT | summary,
        timeout=300,
        check=False,
    )


@pytest.fixture
def with_references(repository: Path) -> Path:
    """The same after its references were made, as the page says."""
    (script,) = re.findall(r"^```sh\n(mkdir -p references\n.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    made = execute(script, repository)
    assert made.returncode == 0, made.stderr
    return repository


def change(scene: Path, factor: float) -> None:
    """Give all lights of a scene another brightness."""
    document = json.loads(scene.read_text())
    for light in document["lights"]:
        light["color"] = [factor * part for part in light["color"]]
    scene.write_text(json.dumps(document))


def test_build_fails_after_a_scene_has_changed(with_references: Path) -> None:
    passed = execute(JOBS[PICTURES], with_references)
    assert passed.returncode == 0, passed.stdout + passed.stderr
    change(with_references / "scenes" / "basic.json", 0.7)
    failed = execute(JOBS[PICTURES], with_references)
    assert failed.returncode == 1, failed.stdout + failed.stderr
    # The scene after the one that failed was tried, too.
    assert re.findall(r"^(\w*match): ", failed.stdout, re.MULTILINE)[0] == "mismatch"
    for name in ("basic", "falloff"):
        assert (with_references / "out" / f"{name}.difference.png").exists()
    (with_references / "scenes" / "basic.json").write_text("{")
    assert execute(JOBS[PICTURES], with_references).returncode == 3


def test_renderer_is_tested_against_its_references(
    with_references: Path,
) -> None:
    words = [sys.executable, "-m", "service.cli.main", "render", "--samples", "4", "--light-samples", "16"]
    (with_references / "renderer.json").write_text(json.dumps(words))
    job = JOBS[".github/workflows/renderer.yml", "tests"]
    passed = execute(job, with_references)
    assert passed.returncode == 0, passed.stdout + passed.stderr
    change(with_references / "scenes" / "basic.json", 0.7)
    failed = execute(job, with_references)
    assert failed.returncode == 1
    assert "1 failed, 1 passed" in failed.stdout
    assert list((with_references / "out").glob("*/difference.png"))
    assert (with_references / "out" / "report.xml").exists()


@pytest.mark.parametrize("job", GRADES, ids=str)
def test_submission_passes_or_fails_by_its_points(repository: Path, job: tuple[str, str]) -> None:
    assignment, handed_in = repository / "assignment", repository / "handed-in"
    shutil.copytree(ROOT / "scenes" / "assignment", assignment)
    shutil.copytree(assignment / "references", handed_in)
    passed = execute(JOBS[job], repository)
    assert passed.returncode == 0, passed.stdout + passed.stderr
    for picture in handed_in.glob("shadow_*.png"):
        picture.unlink()
    failed = execute(JOBS[job], repository)
    assert failed.returncode == 1, failed.stdout + failed.stderr
    assert "shadow" in (repository / "grade.xml").read_text()
    if job[0].startswith(".github"):
        assert "shadow" in (repository / "step-summary").read_text().lower()
