"""Students see no more of a test than its feedback allows, on any platform; staff see everything."""

import base64
import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from schemas.grading.grades import Feedback, Grade, GradeImage, Lateness, Override
from service.grading.exports import EXPORTS
from service.grading.exports.classroom50 import REQUIRED
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels
from tests.service.grading.exports.samples import failed, result, tried

LEVELS: tuple[Feedback, ...] = ("none", "verdict", "difference", "picture")
FOR_STUDENTS = ("gradescope", "prairielearn", "html", "markdown", "junit")


def shown(folder: Path, feedback: Feedback) -> tuple[Grade, dict[str, bytes]]:
    """A result with a test that failed, and the pictures of both kinds as they stand in documents."""
    images, found = [], {}
    for code, kind in enumerate(("difference", "picture")):
        file = folder / f"{kind}.png"
        Image.fromarray(np.full((8, 8, 3), code, np.uint8)).save(file)
        images.append(GradeImage(label=kind, file=file.name, feedback=kind))  # type: ignore[arg-type]
        found[kind] = base64.b64encode(file.read_bytes())
    test = failed(images=tuple(images), feedback=feedback, message="SECRET CAUSE")
    return result(test), found


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("form", FOR_STUDENTS)
def test_students_see_what_the_feedback_allows(form: str, level: Feedback, tmp_path: Path) -> None:
    grade, pictures = shown(tmp_path, level)
    document = EXPORTS[form](grade, tmp_path)
    explained = LEVELS.index(level) >= LEVELS.index("difference")
    assert (b"SECRET CAUSE" in document) == explained
    assert (b"columns 2 to 9" in document) <= explained
    for kind, content in pictures.items():
        assert (content in document) <= (kind == level)


@pytest.mark.parametrize("level", LEVELS)
def test_staff_see_everything(level: Feedback, tmp_path: Path) -> None:
    grade, pictures = shown(tmp_path, level)
    document = EXPORTS["html-staff"](grade, tmp_path)
    assert b"SECRET CAUSE" in document
    assert pictures["picture"] in document


@pytest.mark.parametrize(("changes", "level"), [({}, "difference"), ({"feedback": "picture"}, "picture")])
def test_references_are_shown_only_where_the_manifest_says_so(
    assignment: Assignment, changes: dict[str, str], level: str, tmp_path: Path
) -> None:
    assignment.hand_in("picture.npy", pixels(SCENE)[::-1])
    found = assignment.run(image_test(**changes), pictures=True)
    for name, content in found.pictures.items():
        (tmp_path / name).write_bytes(content)
    page = EXPORTS["html"](found.grade, tmp_path)
    (image,) = (image for image in found.grade.tests[0].images if image.feedback == level)
    assert page.count(b"<image ") == 1
    assert base64.b64encode(found.pictures[image.file]) in page


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("form", [*FOR_STUDENTS, "classroom50", "csv", "html-staff"])
def test_lateness_and_points_of_staff_are_shown(
    form: str, level: Feedback, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (*REQUIRED.values(), "REVIEW_URL"):
        monkeypatch.setenv(name, "x")
    changed = Override(reason="Agreed in person", points=8, status="partial")
    late = Lateness(deadline="2026-05-31T12:00:00Z", days=2, points=4)
    grade = result(tried(override=changed, feedback=level), tried("b"), late=late, score=16)
    document = EXPORTS[form](grade, None).decode()
    if form == "csv":
        (row,) = csv.DictReader(io.StringIO(document))
        assert (row["score"], row["earned"], row["days_late"]) == ("16.0", "20.0", "2")
        assert [name for name in row if name.startswith("points_")] == ["points_soft", "points_b"]
        return
    assert "-4" in document
    assert "Late by 2 days" in document
    assert "Agreed in person" in document
    assert "8" in document.partition("Agreed in person")[0].rpartition("Staff")[2]
    if form in {"gradescope", "classroom50"}:
        read = json.loads(document)
        assert read["score"] == 16 == sum(test["score"] for test in read["tests"])
