"""Whole wrong programs: they are independent of the grader, make their mistakes, and are judged strictly."""

import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from accuracy.comparison.diagnosis import JAGGED
from accuracy.comparison.mistakes import candidates
from scenes.make_assignment import PICTURES
from scenes.make_assignment_parts import FOLDER
from scenes.make_assignment_rays import RAYS
from schemas.grading.grades import Grade
from schemas.grading.manifest_reading import read_manifest
from service.grading.classes.class_grading import grade_class
from service.grading.classes.class_records import Student
from service.grading.mistakes.hints import HINTS
from tests.service.grading.assignment import program
from tests.service.grading.assignment.programs import PROGRAMS, Program, reached
from tests.service.grading.assignment.shapes import Wrong
from tests.service.grading.assignment.tracer import Tracer, encoded

ROOT = FOLDER.parents[3]

PACKAGES = ("schemas", "renderer", "accuracy", "service", "scenes")

SMALL = {"width": 32, "height": 24}

BLUR = Program("blur", "a blur", ("too_soft", "too_smooth"), ("is blurred",))


def test_there_are_24_programs_with_different_mistakes() -> None:
    assert len({each.name for each in PROGRAMS}) == 24


def test_the_grader_knows_every_cause_of_a_program() -> None:
    square = np.full((4, 4, 3), 0.5)
    undone = {mistake.cause for mistake in candidates(square, 0.9 * square)}
    assert {cause for each in PROGRAMS for cause in each.causes} <= {*HINTS, *undone, JAGGED}


def test_a_program_shares_no_code_with_what_grades_it() -> None:
    loaded = (
        "import sys, tests.service.grading.assignment.__main__; "
        "print(*sorted({name.split('.')[0] for name in sys.modules}), sep='\\n')"
    )
    run = subprocess.run([sys.executable, "-c", loaded], check=True, cwd=ROOT, capture_output=True, text=True)
    names = run.stdout.split()
    assert "numpy" in names
    assert not set(names) & set(PACKAGES)


def test_a_program_finds_every_scene_of_the_assignment() -> None:
    assert set(program.names(FOLDER)) == {*PICTURES, *RAYS}


@pytest.mark.parametrize("wrong", PROGRAMS, ids=lambda wrong: wrong.name)
def test_every_switch_changes_a_picture_or_a_ray_table(wrong: Program) -> None:
    right, switched = frozenset[str](), frozenset([wrong.name])
    assert any(not np.array_equal(small(name, right), small(name, switched)) for name in (*PICTURES, *RAYS))


@cache
def small(name: str, wrong: Wrong) -> np.ndarray:
    """Codes of a small picture, the same random numbers for all programs, or the t of a ray table."""
    if name in RAYS:
        return program.hits(FOLDER, name, wrong)["t"]
    scene = program.read(FOLDER, name)
    tracer = Tracer(scene | {"camera": scene["camera"] | SMALL}, FOLDER, wrong)
    return encoded(tracer.picture(samples=4), wrong)


def test_the_last_shape_is_drawn_in_ray_tables_too() -> None:
    right, wrong = (
        program.hits(FOLDER, "rays_flat", frozenset(names)) for names in ([], ["last_shape_wins"])
    )
    hit = np.isfinite(right["t"])
    assert (np.isfinite(wrong["t"]) == hit).all()
    assert (wrong["t"][hit] >= right["t"][hit]).all()
    assert (wrong["t"][hit] > right["t"][hit]).any()


def test_the_command_writes_ray_tables_and_pictures(tmp_path: Path) -> None:
    given = tmp_path / "scenes"
    given.mkdir()
    for file in ("rays_flat.json", "rays_flat.npz", "camera_straight.json"):
        given.joinpath(file).write_bytes(FOLDER.joinpath(file).read_bytes())
    command(given, tmp_path / "out", "--wrong", "bgr", "--samples", "1", check=True)
    assert {file.name for file in (tmp_path / "out").iterdir()} == {"rays_flat.npz", "camera_straight.png"}


def test_a_folder_without_scenes_is_refused_with_its_name(tmp_path: Path) -> None:
    run = command(tmp_path, tmp_path / "out")
    assert run.returncode == 2
    assert f"{tmp_path} has no scenes" in run.stderr


def command(*arguments: str | Path, check: bool = False) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "tests.service.grading.assignment", *map(str, arguments)]
    return subprocess.run(line, check=check, cwd=ROOT, capture_output=True, text=True)


def part(test: str, cause: str | None, message: str = "") -> dict[str, Any]:
    return {"test": test, "cause": cause, "message": message}


@pytest.mark.parametrize(
    ("lost", "verdict"),
    [
        ([], "none"),
        ([part("antialiasing", None, "rmse is 0.03. Look at columns 0 to 9.")], "none"),
        ([part("antialiasing", "too_soft"), part("texture", "too_smooth")], "right"),
        ([part("antialiasing", "too_soft"), part("texture", None)], "right"),
        ([part("antialiasing", None, "It is blurred, is blurred.")], "right"),
        ([part("antialiasing", "too_soft"), part("texture", "exposure")], "wrong"),
        ([part("rays-flat", None, "")], "none"),
        ([part("rays-flat", None, "Many rays miss what they should hit.")], "wrong"),
    ],
)
def test_one_wrong_name_outweighs_right_ones(lost: list[dict[str, Any]], verdict: str) -> None:
    assert BLUR.verdict(lost) == verdict


@pytest.mark.parametrize(
    ("right", "wrong", "word"), [(22, 0, "met"), (24, 0, "met"), (21, 0, "missed"), (23, 1, "missed")]
)
def test_the_goal_counts_right_and_wrong_names(right: int, wrong: int, word: str) -> None:
    verdicts = ["right"] * right + ["wrong"] * wrong + ["none"] * (24 - right - wrong)
    line = reached(verdicts)
    assert line.startswith(f"named right: {right} of 24")
    assert line.endswith(f"the goal is {word}")


CAMERA = {"camera-straight", "camera-tilted"}
PHONG = {"phong-matte", "phong-highlights"}
EDGES = {"antialiasing", "antialiasing-advanced"}

WHOLE: tuple[tuple[tuple[str, ...], set[str], set[str]], ...] = (
    (("corner_sampling",), EDGES, {"antialiasing_missing"}),
    (("gamma_power",), set(), set()),
    (("size_minus_one",), CAMERA, {"size_minus_one"}),
    (("upside_down", "gamma_missing"), CAMERA, {"flipped_vertically", "gamma_missing"}),
    (("bgr", "half_pixel_off"), CAMERA, {"channels_bgr", "half_pixel_right_down"}),
    (("no_ambient", "brighter"), PHONG, {"ambient_missing", "exposure"}),
)
"""Mistakes of whole programs, the tests that they cost points in, and all causes named there."""


@pytest.fixture(scope="module")
def grades(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Grade]:
    """Grades of the whole programs, as of a class: altered pictures are rendered once for all."""
    folder = tmp_path_factory.mktemp("programs")
    students = [Student(folder / named(wrong)) for wrong, _, _ in WHOLE]
    for (wrong, _, _), student in zip(WHOLE, students, strict=True):
        program.run(FOLDER, student.folder, frozenset(wrong))
    manifest = read_manifest((FOLDER / "manifest.yaml").read_bytes(), yaml=True)
    return {found.student.name: found.grade for found in grade_class(manifest, students, references=FOLDER)}


def named(mistakes: Iterable[str]) -> str:
    return " and ".join(sorted(mistakes))


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "lost", "causes"), WHOLE, ids=named)
def test_a_mistake_of_a_whole_program_costs_points_once(
    wrong: tuple[str, ...], lost: set[str], causes: set[str], grades: dict[str, Grade]
) -> None:
    found = grades[named(wrong)]
    assert {test.id for test in found.tests if test.points < test.max_points} == lost
    assert {cause.cause for test in found.tests if test.id in lost for cause in test.diagnosis} == causes
    assert found.score >= 100
