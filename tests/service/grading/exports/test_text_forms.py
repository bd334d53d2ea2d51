"""JUnit XML, rows of a gradebook, and Markdown."""

import csv
import io
import re
from xml.etree import ElementTree

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

from schemas.grading.grades import Grade
from service.grading.exports import EXPORTS
from service.grading.exports.texts import harmless, line
from tests.service.grading.exports.jenkins_xunit import faults
from tests.service.grading.exports.samples import (
    FOR_STAFF,
    HIDDEN,
    HOSTILE,
    broken,
    failed,
    hostile,
    not_gradable,
    result,
    secret,
    tried,
)


def tree(grade: Grade) -> ElementTree.Element:
    """The JUnit XML of a result, parsed."""
    root = ElementTree.fromstring(EXPORTS["junit"](grade, None))  # noqa: S314 - made here
    assert list(faults(root)) == []
    return root


def numbers(case: ElementTree.Element) -> dict[str, str]:
    """The lines of a case's output."""
    lines = (case.findtext("system-out") or "").splitlines()
    return {name: value for name, _, value in (text.partition(": ") for text in lines)}


def test_junit_has_a_case_for_each_test_with_its_points() -> None:
    tests = [tried(points=10.0), failed(), failed("part", points=2.5, status="partial")]
    cases = tree(result(*tests)).findall("testsuite/testcase")
    assert [case.attrib["name"] for case in cases] == ["Soft", "Phong", "Part"]
    assert [numbers(case)["points"] for case in cases] == ["10", "0", "2.5"]
    assert numbers(cases[1]) | {"metric": "bias_blocks", "verdict": "mismatch"} == numbers(cases[1])


def test_junit_outcomes_are_mapped_and_counted() -> None:
    tests = [tried(), failed(), failed("part", status="partial", points=5.0), not_gradable(), broken()]
    root = tree(result(*tests, failed("absent", status="skipped")))
    outcomes = [
        [child.tag for child in case if child.tag != "system-out"]
        for case in root.findall("testsuite/testcase")
    ]
    assert outcomes == [[], ["failure"], ["failure"], ["error"], ["error"], ["skipped"]]
    counted = {"tests": "6", "failures": "2", "errors": "2"}
    assert root.attrib | counted == root.attrib
    assert root[0].attrib | counted | {"skipped": "1"} == root[0].attrib


def test_untrusted_strings_are_text_in_xml() -> None:
    cases = tree(hostile()).findall("testsuite/testcase")
    assert [case.attrib["name"] for case in cases] == [line(words[:200]) for words in HOSTILE]
    texts = [failure.text or "" for case in cases for failure in case.findall("failure")]
    assert all(text.startswith(harmless(words)) for text, words in zip(texts, HOSTILE, strict=True))


@pytest.mark.parametrize("form", ["junit", "markdown", "csv", "html"])
def test_hidden_tests_and_signals_are_not_for_students(form: str) -> None:
    document = EXPORTS[form](result(tried(), secret()), None).decode()
    assert HIDDEN not in document
    assert FOR_STAFF not in document
    assert "identical_bytes" not in document
    assert "idden" in document


def table(form: str, grade: Grade) -> dict[str, str]:
    header, row = csv.reader(io.StringIO(EXPORTS[form](grade, None).decode(), newline=""))
    return dict(zip(header, row, strict=True))


def test_row_has_the_total_and_the_points_of_each_test() -> None:
    row = table("csv", result(tried(), failed(), secret()))
    assert row == {
        "student": "Zoë",
        "submitted": "2026-06-01T16:32:01+02:00",
        "assignment": "Ray tracer",
        "score": "14.0",
        "max_score": "30.0",
        "earned": "14.0",
        "days_late": "0",
        "ungraded": "0",
        "points_soft": "10.0",
        "points_phong": "0.0",
        "points_hidden": "4.0",
    }


def test_row_for_staff_has_hidden_tests_and_signals() -> None:
    row = table("csv-staff", result(tried(), secret()))
    assert row[f"points_{HIDDEN}"] == "4.0"
    assert row["signals"] == "soft: identical_bytes"


def test_open_test_and_total_are_empty_cells() -> None:
    row = table("csv", result(tried(), not_gradable()))
    assert (row["points_camera"], row["points_soft"], row["score"], row["ungraded"]) == ("", "10.0", "", "1")
    bonus = not_gradable().model_copy(update={"bonus": True})
    assert table("csv", result(tried(), bonus))["score"] == "10.0"


@pytest.mark.parametrize("form", ["csv", "csv-staff"])
@pytest.mark.parametrize(
    "words",
    [*HOSTILE, "=1+1", "+1", "-1", "@a", "\t=1", "\uff1d1", " =1", "a;=1", "a ; -1", 'a;"=1"', "a,@b"],
)
def test_untrusted_cell_is_no_formula(form: str, words: str) -> None:
    row = table(form, result(tried(), student=words, title=words))
    assert row["student"].replace("'", "") == line(words).replace("'", "")
    # Spreadsheets split at commas or at semicolons, as their country has it.
    for cell in re.split("[,;]", f"{row['student']};{row['assignment']}"):
        assert cell.strip(' "')[:1] not in set("=+-@\t\r\n\uff1d\uff0b\uff0d\uff20")


def tokens(grade: Grade) -> list[Token]:
    """The summary, parsed as GitHub's Markdown."""
    blocks = MarkdownIt("commonmark").enable("table").parse(EXPORTS["markdown"](grade, None).decode())
    return [token for block in blocks for token in (block, *(block.children or ()))]


def test_untrusted_strings_are_text_in_markdown() -> None:
    grade = hostile()
    found = tokens(grade)
    assert {token.type for token in found if not token.type.startswith(("t", "paragraph", "heading"))} == {
        "inline",
        "strong_open",
        "strong_close",
    }
    rows = sum(token.type == "tr_open" for token in found)
    cells = sum(token.type == "td_open" for token in found)
    assert (rows, cells) == (1 + len(grade.tests), 4 * len(grade.tests))
