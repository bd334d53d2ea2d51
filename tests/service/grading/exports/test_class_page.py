"""The gradebook and the page of a class."""

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import unquote_to_bytes

import pytest

from schemas.grading.classes import ClassGrade, SharedNoise
from schemas.grading.grades import Grade, GradeInput
from service.grading.classes.class_grading import of_class
from service.grading.classes.class_records import Student
from service.grading.classes.class_signals import shared_files
from service.grading.exports.class_page import class_page, histogram
from service.grading.exports.gradebook import for_class
from tests.service.grading.exports.samples import HOSTILE, failed, result, tried
from tests.service.grading.exports.test_page import Page

BOM = b"\xef\xbb\xbf"


def read(test: str, digest: str, size: int | None = 3) -> GradeInput:
    return GradeInput(test=test, role="submission", name="p.png", sha256=digest, size=size)


def graded(name: str, *inputs: GradeInput, points: float = 10.0) -> tuple[Student, Grade]:
    student = Student(Path("class") / name)
    tests = (tried(points=points, status="passed" if points == 10 else "partial"), failed())
    return student, result(*tests, student=student.name, inputs=inputs)


def whole_of(graded: Sequence[tuple[Student, Grade]], *noise: SharedNoise) -> ClassGrade:
    files = shared_files({student.name: grade for student, grade in graded})
    return of_class("Ray tracer", dict(graded), files=files, noise=noise, left_out=["a.zip", "<b>.txt"])


def page_of(graded: Sequence[tuple[Student, Grade]], *noise: SharedNoise) -> str:
    grades = {student.name: grade for student, grade in graded}
    return class_page(whole_of(graded, *noise), grades, "staff.html").decode()


def rows_of(graded: Sequence[tuple[Student, Grade]], *noise: SharedNoise) -> list[dict[str, str]]:
    content = for_class([grade for _, grade in graded], whole_of(graded, *noise))
    assert content.startswith(BOM)
    assert not content[3:].startswith(BOM)
    return list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))


def links_of(text: str) -> set[bytes]:
    attributes = Page(text.encode()).attributes
    return {unquote_to_bytes(value) for _, name, value in attributes if name == "href"}


def test_gradebook_has_a_row_for_each_submission() -> None:
    rows = rows_of([graded("zoë", read("soft", "1")), graded("张伟", read("soft", "1"), points=10 / 3)])
    assert [row["student"] for row in rows] == ["zoë", "张伟"]
    assert [row["points_soft"] for row in rows] == ["10.0", "3.33"]
    assert [row["same_files_as"] for row in rows] == ["张伟: soft", "zoë: soft"]


def test_shared_noise_is_in_gradebook_and_page() -> None:
    students = [graded("ada"), graded("zoë"), graded("yan")]
    noise = SharedNoise(students=("ada", "zoë"), tests=("soft",), correlation=0.97)
    assert [row["same_noise_as"] for row in rows_of(students, noise)] == ["zoë: soft", "ada: soft", ""]
    text = page_of(students, noise)
    signals = text[text.index("<h2>Signals") : text.index("<h2>Submissions")]
    assert "the same noise" in signals
    assert links_of(signals) == {
        b"students/ada/staff.html",
        "students/zoë/staff.html".encode(),
        # All samples have a signal of their own.
        b"students/yan/staff.html",
    }


@pytest.mark.parametrize("words", [*HOSTILE, "=1+1", "@a"])
def test_names_are_no_formulas_and_no_markup(words: str) -> None:
    name = words.replace("\x00", "").replace("/", "-").replace("\ud800", "")
    students = [graded(name)]
    (row,) = rows_of(students)
    assert row["student"][:1] not in set("=+-@\t\r\n")
    assert {"script", "img", "failure"}.isdisjoint(Page(page_of(students).encode()).tags)


@pytest.mark.parametrize("name", ["zoë", "a b", "50%", "a?b#c", "..a", "a\nb", os.fsdecode(b"zo\xeb")])
def test_links_lead_to_the_folder_of_any_name(name: str) -> None:
    assert links_of(page_of([graded(name)])) == {b"students/" + os.fsencode(name) + b"/staff.html"}


def test_causes_are_counted_most_frequent_first() -> None:
    grades = [graded("a"), graded("b", points=5.0), graded("c")]
    late = (Student(Path("class/d")), result(tried("soft", status="skipped", points=0.0), student="d"))
    text = page_of([*grades, late])
    causes = text[text.index("Lost points") : text.index("<h2>Signals")]
    unexplained = "<td>no cause found</td><td class=points>3</td><td>phong (3), soft (1)</td>"
    missing = "<td>not submitted</td><td class=points>1</td><td>soft (1)</td>"
    assert 0 < causes.index(unexplained) < causes.index(missing)


@pytest.mark.parametrize(
    ("score", "place", "bars"),
    [(0, 0, 10), (5, 0, 10), (99.999, 9, 10), (100, 10, 11), (135, 13, 14), (1e6, 19, 20)],
)
def test_histogram_has_each_score_in_one_bar(score: float, place: int, bars: int) -> None:
    counts = histogram([score], 100.0)
    assert (len(counts), sum(counts), counts.index(1)) == (bars, 1, place)
