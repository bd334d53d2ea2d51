import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from schemas.grading.grades import Grade
from tests.service.cli.conftest import Penumbra
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels

WORDS = ("grade", "assignment/manifest.json", "--submission", "submission")


@pytest.fixture
def assignment(tmp_path: Path) -> Assignment:
    """A right picture, handed in; the same upside down too."""
    made = Assignment.of(tmp_path)
    made.hand_in("picture.npy", pixels(SCENE))
    made.hand_in("flipped.npy", pixels(SCENE)[::-1])
    return made


def flipped(**changes: Any) -> dict[str, Any]:
    return image_test(id="flipped", submitted={"file": "flipped.npy", "encoding": "linear"}, **changes)


@pytest.mark.slow
def test_line_a_test_on_a_pipe(penumbra: Penumbra, assignment: Assignment) -> None:
    assignment.manifest(image_test(), flipped(points=2.5))
    outcome = penumbra(*WORDS)
    assert (outcome.code, outcome.err) == (0, "")
    first, second, for_staff, whole = outcome.out.splitlines()
    assert first.split("\t") == ["passed", "10/10", "A picture", "picture", ""]
    assert second.split("\t")[:4] == ["failed", "0/2.5", "A picture", "flipped"]
    assert "flipped_vertically" in second
    assert for_staff.startswith("for staff: picture: ")
    assert whole.startswith("10 of 12.5 ")
    assert whole.endswith(" mismatch")


@pytest.mark.slow
def test_result_with_pictures_and_exports(here: Penumbra, assignment: Assignment, tmp_path: Path) -> None:
    assignment.manifest(image_test(), flipped())
    exports = ("--export", "gradescope=results.json", "--export", "junit=report.xml")
    student = ("--student", "ada", "--submitted-at", "2026-11-21T20:15:00+00:00")
    outcome = here(*WORDS, *student, "-o", "new/folder", *exports, "--fail-under", 10, "--json")
    assert outcome.code == 0
    found = Grade.model_validate(outcome.document)
    assert (found.score, found.student, found.submitted) == (10, "ada", "2026-11-21T20:15:00+00:00")
    made = tmp_path / "new" / "folder"
    assert Grade.model_validate_json((made / "result.json").read_bytes()) == found
    named = {image.file for test in found.tests for image in test.images}
    assert len(named) == 4
    assert {path.name for path in made.iterdir()} == named | {"result.json"}
    assert json.loads((tmp_path / "results.json").read_text())["score"] == 10
    assert (tmp_path / "report.xml").read_text().startswith("<?xml")


def test_fail_under_exit_code(here: Penumbra, assignment: Assignment) -> None:
    assignment.manifest(flipped())
    assert here(*WORDS, "--fail-under", 0.01).code == 1


def test_nothing_gradable_exit_code(here: Penumbra, assignment: Assignment, tmp_path: Path) -> None:
    assignment.hand_in("picture.npy", np.full((32, 48, 3), np.nan, np.float32))
    assignment.manifest(image_test())
    outcome = here(*WORDS, "-o", "out")
    assert outcome.code == 3
    # The dash is no zero.
    assert outcome.out.startswith("not_gradable\t-/10\t")
    assert json.loads((tmp_path / "out" / "result.json").read_text())["gradable"] is False


@pytest.mark.parametrize(
    ("words", "code", "reported"),
    [
        (("grade", "wrong.yaml"), 3, "/test  line 3, column 1"),
        (("grade", "none.yaml"), 3, "none.yaml"),
        (("grade", "manifest.txt"), 2, ".yaml"),
        ((*WORDS, "--submission", "nowhere"), 3, "nowhere"),
        ((*WORDS, "--export", "gradescop=a.json"), 2, "gradescope"),
        ((*WORDS, "--export", "gradescope=nowhere/a.json"), 2, "nowhere"),
        ((*WORDS, "--export", "html=a.html", "--export", "html-staff=./a.html"), 2, "its own file"),
        ((*WORDS, "--export", "html=a.html", "--export", "html=b.html"), 2, "each form once"),
        ((*WORDS, "--export", "classroom50=a.json"), 2, "CLASSROOM is not set"),
        ((*WORDS, "--submitted-at", "yesterday"), 2, "yesterday"),
        ((*WORDS, "--roster", "wrong.yaml"), 2, "--submitted-at"),
        ((*WORDS, "--overrides", "wrong.yaml", "--student", "ada"), 3, "wrong.yaml: line 1 lacks student"),
        (("grade", "late.json", *WORDS[2:]), 2, "late policy"),
        ((*WORDS, "--server", "http://127.0.0.1:9"), 4, "127.0.0.1:9"),
    ],
)
def test_unusable_arguments(
    here: Penumbra, tmp_path: Path, words: tuple[str, ...], code: int, reported: str
) -> None:
    Assignment.of(tmp_path).manifest(image_test())
    late = json.loads((tmp_path / "assignment" / "manifest.json").read_text())
    late["late"] = {"deadline": "2026-11-21T23:59:00Z", "per_day": 0.1}
    (tmp_path / "late.json").write_text(json.dumps(late))
    (tmp_path / "wrong.yaml").write_text("schema: penumbra/manifest/v1\ntitle: T\ntest: []\n")
    outcome = here(*words)
    assert (outcome.code, outcome.out) == (code, "")
    assert reported in outcome.err


@pytest.mark.slow
def test_lines_fit_a_terminal(on_a_terminal: Penumbra, assignment: Assignment) -> None:
    assignment.manifest(image_test(), flipped(advice="See lecture 2, and " + "then " * 30))
    lines = on_a_terminal(*WORDS).out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].split() == ["passed", "10/10", "A", "picture"]
