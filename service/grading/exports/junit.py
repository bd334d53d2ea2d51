"""JUnit XML for GitLab and Jenkins: one testcase for each test.

Elements that GitLab reads: https://docs.gitlab.com/ci/testing/unit_test_reports/. The xUnit plugin of Jenkins
checks files against its junit-10.xsd: there a testcase has no properties, and only a suite counts skipped
tests.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from schemas.grading.grades import Grade
from service.grading.exports.rows import Row, for_students, headline
from service.grading.exports.texts import line, number

NUMBERS = ("metric", "value", "threshold", "margin", "verdict")


def export(grade: Grade, _pictures: Path | None = None) -> bytes:
    """Export a result as JUnit XML.

    JUnit has no partial credit: a test that lost points fails, and its output holds the points, a line each.
    A test that could not be graded is an error, one without a submitted file is skipped. Pictures are
    not supported.
    """
    rows = for_students(grade)
    counts = {
        "tests": str(len(rows)),
        "failures": str(sum(_outcome(row) == "failure" for row in rows)),
        "errors": str(sum(_outcome(row) == "error" for row in rows)),
        "time": f"{grade.timings.seconds:.3f}",
    }
    root = Element("testsuites", {"name": line(grade.title)} | counts)
    skipped = str(sum(_outcome(row) == "skipped" for row in rows))
    suite = SubElement(root, "testsuite", {"name": line(grade.title)} | counts | {"skipped": skipped})
    values = {
        "summary": headline(grade),
        "score": number(grade.score),
        "max_score": number(grade.max_score),
        "ungraded": str(len(grade.ungraded)),
        "tool": f"{grade.tool.name} {grade.tool.version}",
    }
    properties = SubElement(suite, "properties")
    for name, value in values.items():
        SubElement(properties, "property", {"name": name, "value": value})
    for row in rows:
        _case(suite, grade, row)
    indent(root)
    content: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _case(suite: Element, grade: Grade, row: Row) -> None:
    # A report keeps only one test of the same class and name.
    words = {
        "classname": f"{line(grade.title)}.{row.id or ('late' if row.is_deduction else 'hidden')}",
        "name": row.name,
    }
    case = SubElement(suite, "testcase", words | {"time": f"{row.seconds:.3f}"})
    numbers = {} if row.test is None else {name: getattr(row.test, name) for name in NUMBERS}
    written = {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in numbers.items()}
    points = {"points": number(row.points), "max_points": number(row.max_points), "status": row.status}
    if row.status == "passed" and row.message:
        points["message"] = line(row.message)
    known = points | {name: value for name, value in written.items() if value is not None}
    if outcome := _outcome(row):
        first = row.message.split("\n", 1)[0]
        reason = SubElement(case, outcome, {"message": first, "type": row.status})
        reason.text = "\n".join((row.message, *row.places))
    SubElement(case, "system-out").text = "\n".join(f"{name}: {value}" for name, value in known.items())


def _outcome(row: Row) -> str | None:
    if row.open:
        return "error"
    return {"passed": None, "skipped": "skipped"}.get(row.status, "failure")
