"""The gradebook and the page of a class."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote_to_bytes

import pytest

from schemas.grading.classes import ClassGrade
from schemas.grading.grades import Grade, GradeInput
from service.grading.class_records import Student
from service.grading.class_results import of_class
from service.grading.exports.class_page import BINS, class_page, histogram
from service.grading.exports.gradebook import for_class
from tests.unit.grading.exports.samples import HOSTILE, failed, not_gradable, result, tried

BOM = b"\xef\xbb\xbf"


def read(test: str, digest: str, size: int | None = 3) -> GradeInput:
    return GradeInput(test=test, role="submission", name="p.png", sha256=digest, size=size)


def graded(name: str, *inputs: GradeInput, points: float = 10.0) -> tuple[Student, Grade]:
    student = Student(Path("class") / name)
    tests = (tried(points=points, status="passed" if points == 10 else "partial"), failed())
    return student, result(*tests, student=student.name, inputs=inputs)


def whole_of(graded: Sequence[tuple[Student, Grade]]) -> ClassGrade:
    return of_class("Ray tracer", 20.0, graded)


def page_of(graded: Sequence[tuple[Student, Grade]]) -> str:
    grades = {student.name: grade for student, grade in graded}
    return class_page(whole_of(graded), grades, "staff.html").decode()


class Links(HTMLParser):
    """Addresses of links, and the names of all elements."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.tags: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.links += [value or "" for name, value in attrs if name == "href"]


def test_the_same_bytes_of_a_test_are_shared_files() -> None:
    students = [
        graded("a", read("soft", "1"), read("phong", "2")),
        graded("b", read("soft", "1"), read("phong", "2")),
        graded("c", read("soft", "3"), read("phong", "4")),
    ]
    (shared,) = whole_of(students).shared_files
    assert (shared.students, shared.tests) == (("a", "b"), ("phong", "soft"))


def test_rendered_pictures_and_other_tests_are_no_shared_files() -> None:
    students = [
        graded("a", read("soft", "1", None), read("phong", "2")),
        graded("b", read("soft", "1", None), read("flat", "2")),
    ]
    assert whole_of(students).shared_files == ()


def test_a_gradebook_has_a_row_for_each_submission_after_a_byte_order_mark() -> None:
    students = [graded("zoë", read("soft", "1")), graded("张伟", read("soft", "1"), points=10 / 3)]
    content = for_class([grade for _, grade in students], whole_of(students).shared_files)
    assert content.startswith(BOM)
    assert not content[3:].startswith(BOM)
    rows = list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))
    assert [row["student"] for row in rows] == ["zoë", "张伟"]
    assert [row["points_soft"] for row in rows] == ["10.0", "3.33"]
    assert [row["same_files_as"] for row in rows] == ["张伟: soft", "zoë: soft"]


@pytest.mark.parametrize("words", [*HOSTILE, "=1+1", "@a"])
def test_no_name_is_a_formula_or_markup(words: str) -> None:
    name = words.replace("\x00", "").replace("/", "-").replace("\ud800", "")
    students = [graded(name)]
    content = for_class([grade for _, grade in students], ())
    (row,) = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""))
    assert row["student"][:1] not in set("=+-@\t\r\n")
    assert Links(page_of(students)).tags.isdisjoint({"script", "img", "failure"})


@pytest.mark.parametrize("name", ["zoë", "a b", "50%", "a?b#c", "..a", "a\nb", os.fsdecode(b"zo\xeb")])
def test_links_lead_to_the_folder_of_any_name(name: str) -> None:
    links = Links(page_of([graded(name)])).links
    assert {unquote_to_bytes(link) for link in links} == {b"students/" + os.fsencode(name) + b"/staff.html"}


def test_causes_are_counted_and_the_most_frequent_comes_first() -> None:
    students = [graded("a"), graded("b", points=5.0), graded("c")]
    text = page_of(students)
    causes = text[text.index("Lost points") : text.index("The same files")]
    assert causes.index("<td>Phong</td><td>no cause found</td><td class=points>3</td>") < causes.index(
        "<td>Soft</td><td>no cause found</td><td class=points>1</td>"
    )


@pytest.mark.parametrize("score", [0.0, 5.0, 99.999, 100.0, 135.0])
def test_each_score_is_in_one_bar(score: float) -> None:
    counts = histogram([score], 100.0)
    assert (len(counts), sum(counts)) == (BINS, 1)
    assert counts.index(1) == min(int(score // 10), BINS - 1)


def test_a_class_without_a_complete_submission_has_a_page() -> None:
    grade = result(not_gradable(), student="a")
    text = page_of([(Student(Path("class/a")), grade)])
    assert "1 with tests that could not be graded" in text
    assert "<svg" not in text
