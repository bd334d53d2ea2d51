"""The ready assignment: correct submissions have full marks, wrong ones lose points and are diagnosed."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from scenes.make_assignment_parts import FOLDER
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import Manifest, RaysTest
from service.grading.folders import Folder
from service.grading.grading import grade
from service.grading.kinds import findings
from service.grading.programs.program_search import search
from service.grading.settings import Run
from tests.service.grading.assignment import submissions
from tests.service.grading.assignment.mistakes import MISTAKES, RAYS, Mistake

RUBRIC = {
    "camera": 10,
    "rays": 30,
    "phong": 15,
    "shadow": 25,
    "antialiasing": 10,
    "texture": 10,
    "normal": 15,
}
"""Points by the first word of the tests' ids; anti-aliasing has the same number again as bonus."""

QUICK = {"blinn", "far_single", "hard_shadow", "no_shadows", "texture_upside_down", "triangle_too_large"}
"""Mistakes that every test run tries, in one file each."""


@cache
def manifest(name: str = "manifest.yaml") -> Manifest:
    return read_manifest((FOLDER / name).read_bytes(), yaml=True)


TESTS = {test.id.replace("-", "_"): test for test in manifest().tests}


def test_points_are_those_of_the_rubric() -> None:
    for name in ("manifest.yaml", "manifest-pictures.yaml"):
        given: dict[str, float] = {}
        for test in manifest(name).tests:
            word = "rays" if test.id.startswith("normals") else re.split("-", test.id)[0]
            given[word] = given.get(word, 0) + test.points
        assert given == RUBRIC | {"antialiasing": 20}


def test_the_manifests_differ_only_in_how_intersections_are_graded() -> None:
    rays, pictures = manifest(), manifest("manifest-pictures.yaml")
    assert [test for test in rays.tests if not isinstance(test, RaysTest)] == [
        test for test in pictures.tests if not test.id.startswith("normals")
    ]


def test_optional_criteria_are_a_bonus_to_90_points() -> None:
    assert sum(test.points for test in manifest().tests if not test.bonus) == 90
    assert {test.id for test in manifest().tests if test.bonus} == {
        "texture",
        "normal-map",
        "antialiasing-advanced",
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", ["manifest.yaml", "manifest-pictures.yaml"])
def test_the_correct_submission_has_full_marks_with_16_random_samples(name: str) -> None:
    found = grade(manifest(name), references=FOLDER, submission=submissions.right()).grade
    assert {test.id: test.message for test in found.tests if test.status != "passed"} == {}
    assert (found.score, found.max_score) == (125, 90)
    assert found.signals == ()


@pytest.mark.slow
@pytest.mark.parametrize("samples", [4, 36])
@pytest.mark.parametrize("name", ["phong_matte", "shadow_soft", "antialiasing"])
def test_more_or_fewer_samples_cost_no_points(name: str, samples: int, tmp_path: Path, keep: Path) -> None:
    submissions.save(tmp_path, name, samples=samples, seed=samples)
    assert graded(name, run_of(tmp_path, keep)) == (1.0, "")


@pytest.mark.parametrize(
    "mistake", [m for m in MISTAKES if m.name in QUICK], ids=lambda mistake: mistake.name
)
def test_a_mistake_loses_points_and_is_named(mistake: Mistake, tmp_path: Path, keep: Path) -> None:
    name = next(iter(mistake.fails))
    submissions.save(tmp_path, name, frozenset([mistake.name]))
    share, cause = graded(name, run_of(tmp_path, keep))
    assert share < 1
    assert mistake.fails[name] in cause


@pytest.mark.slow
@pytest.mark.parametrize(
    "mistake", [m for m in MISTAKES if m.name not in QUICK], ids=lambda mistake: mistake.name
)
def test_every_mistake_loses_the_expected_points_and_is_named(
    mistake: Mistake, tmp_path: Path, keep: Path
) -> None:
    for name in mistake.tried:
        submissions.save(tmp_path, name, frozenset([mistake.name]))
    run = run_of(tmp_path, keep)
    for name in mistake.tried:
        share, cause = graded(name, run)
        if name in mistake.fails:
            assert (name, share < 1) == (name, True)
            assert mistake.fails[name] in cause
        else:
            assert (name, share) == (name, 1.0)


def run_of(submission: Path, keep: Path) -> Run:
    """What grading a submission begins with: the mistakes that its pictures share."""
    folders = Folder(FOLDER.resolve(), "reference"), Folder(submission.resolve(), "submission")
    run = Run(manifest(), *folders, keep=keep)
    return replace(run, mistakes=search(run))


def graded(name: str, run: Run) -> tuple[float, str]:
    """Share of the points, and the first cause or, for rays, the message; empty with full points."""
    *_, outcome = findings(TESTS[name], run)
    if outcome.share == 1:
        return outcome.share, ""
    causes = [cause.cause for cause in outcome.diagnosis]
    return outcome.share, outcome.message if name in RAYS else causes[0] if causes else ""
