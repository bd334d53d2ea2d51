"""The ready assignment: right programs earn all points, and what wrong ones do wrong is named."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import renderer
from accuracy.comparison import compare, picture_of
from scenes.make_assignment_parts import FOLDER
from schemas.grading.grades import Grade
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import Manifest
from service.grading.classes.class_grading import grade_class
from service.grading.classes.class_records import Student
from service.grading.folders import Folder
from service.grading.grading import findings, grade
from service.grading.mistakes.counterfactuals import explain
from service.grading.programs.program_search import search
from service.grading.settings import Run
from tests.service.grading.assignment import tracer
from tests.service.grading.assignment.mistakes import MISTAKES, NOISELESS, RAYS, WHOLE, Mistake
from tests.service.grading.assignments import npy

QUICK = ("far_single", "hard_shadow", "texture_upside_down", "triangle_too_large", "no_ambient", "blinn")
"""Mistakes that every test run tries, in one file each."""


def manifest(name: str = "manifest.yaml") -> Manifest:
    return read_manifest((FOLDER / name).read_bytes(), yaml=True)


MANIFEST = manifest()
TESTS = {test.id.replace("-", "_"): test for test in MANIFEST.tests}


@pytest.fixture(scope="session")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Altered pictures of all submissions here, as those of a class share them."""
    return tmp_path_factory.mktemp("altered")


def run_of(submission: Path, keep: Path) -> Run:
    folders = Folder(FOLDER.resolve(), "reference"), Folder(submission.resolve(), "submission")
    return Run(MANIFEST, *folders, keep=keep)


def graded(name: str, run: Run) -> tuple[float, str]:
    """Share of the points, and the first cause or, for rays, the message; empty with full points."""
    *_, outcome = findings(TESTS[name], run)
    if outcome.share == 1:
        return outcome.share, ""
    causes = [cause.cause for cause in outcome.diagnosis]
    return outcome.share, outcome.message if name in RAYS else causes[0] if causes else ""


def test_manifests_give_90_points_and_a_bonus() -> None:
    for name in ("manifest.yaml", "manifest-pictures.yaml"):
        tests = manifest(name).tests
        assert sum(test.points for test in tests if not test.bonus) == 90
        assert {test.id for test in tests if test.bonus} == {"texture", "normal-map", "antialiasing-advanced"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["manifest.yaml", "manifest-pictures.yaml"])
def test_right_program_earns_all_points(name: str, tmp_path: Path) -> None:
    tracer.run(FOLDER, tmp_path)
    found = grade(manifest(name), references=FOLDER, submission=tmp_path).grade
    assert {test.id: test.message for test in found.tests if test.status != "passed"} == {}
    assert (found.score, found.max_score) == (125, 90)
    assert found.signals == ()


@pytest.mark.slow
@pytest.mark.parametrize("samples", [4, 36])
@pytest.mark.parametrize("name", ["phong_matte", "shadow_soft", "antialiasing"])
def test_number_of_samples_costs_no_points(name: str, samples: int, tmp_path: Path, keep: Path) -> None:
    tracer.save(FOLDER, tmp_path, name, samples=samples, seed=samples)
    assert graded(name, run_of(tmp_path, keep)) == (1.0, "")


@pytest.mark.parametrize("mistake", [m for m in MISTAKES if m.name in QUICK], ids=lambda one: one.name)
def test_mistake_loses_points(mistake: Mistake, tmp_path: Path, keep: Path) -> None:
    name = next(iter(mistake.causes))
    tracer.save(FOLDER, tmp_path, name, frozenset([mistake.name]))
    run = run_of(tmp_path, keep)
    # The first outcome comes before mistakes are reproduced.
    assert next(iter(findings(TESTS[name], replace(run, mistakes=search(run))))).share < 1


@pytest.mark.slow
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda one: one.name)
def test_mistake_loses_its_points_and_no_others(mistake: Mistake, tmp_path: Path, keep: Path) -> None:
    for name in mistake.tried:
        tracer.save(FOLDER, tmp_path, name, frozenset([mistake.name]))
    run = run_of(tmp_path, keep)
    run = replace(run, mistakes=search(run))
    for name in mistake.tried:
        share, said = graded(name, run)
        assert (name, share < 1) == (name, name in mistake.causes)
        assert mistake.causes.get(name, "") in said


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "name", "cause"), NOISELESS)
def test_mistake_is_named_in_a_single_picture(
    wrong: str, name: str, cause: str, tmp_path: Path, keep: Path
) -> None:
    tracer.save(FOLDER, tmp_path, name, frozenset([wrong]), samples=4)
    share, said = graded(name, run_of(tmp_path, keep))
    assert share < 1
    assert said == cause


@pytest.mark.slow
def test_last_shape_is_named_where_it_is_not_the_nearest() -> None:
    document = tracer.read(FOLDER, "shadow_hard")
    scene = renderer.load_scene(document)
    pictures = (
        tracer.Tracer(document, FOLDER, frozenset(["last_shape_wins"])).picture(4),
        renderer.render(renderer.compile_scene(scene)).image,
    )
    found = compare(*(picture_of(npy(pixels.astype(np.float32)), "picture.npy") for pixels in pictures))
    assert explain(scene, found)[0].cause == "last_hit_drawn"


def named(mistakes: Iterable[str]) -> str:
    return " and ".join(sorted(mistakes))


@pytest.fixture(scope="module")
def grades(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Grade]:
    """Grades of the whole programs, as of a class: altered pictures are rendered once for all."""
    folder = tmp_path_factory.mktemp("programs")
    students = [Student(folder / named(wrong)) for wrong, _, _ in WHOLE]
    for (wrong, _, _), student in zip(WHOLE, students, strict=True):
        tracer.run(FOLDER, student.folder, frozenset(wrong))
    return {
        student.name: found.grade for student, found in grade_class(MANIFEST, students, references=FOLDER)
    }


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "lost", "causes"), WHOLE, ids=named)
def test_whole_program_pays_once_for_a_mistake(
    wrong: tuple[str, ...], lost: frozenset[str], causes: set[str], grades: dict[str, Grade]
) -> None:
    found = grades[named(wrong)]
    assert {test.id for test in found.tests if test.points < test.max_points} == lost
    assert {cause.cause for test in found.tests if test.id in lost for cause in test.diagnosis} == causes
    assert found.score >= 100
