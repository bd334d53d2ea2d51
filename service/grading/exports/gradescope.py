"""``results.json`` of a Gradescope autograder.

Fields: https://gradescope-autograders.readthedocs.io/en/latest/specs/
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from schemas.grading.grades import Grade, TestGrade
from service.grading.exports.pictures import Shown, album
from service.grading.exports.rows import Row, for_platform, headline
from service.grading.exports.texts import encoded, line, rounded, significant

MOST_PICTURES = 1_000_000
"""Bytes. Gradescope documents no limit, but the page of a submission loads all pictures at once."""

LATER = ("after_due_date", "after_published")
"""Tags of a hidden test that set when it is shown, as Gradescope names them."""


def export(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export a result for Gradescope.

    A hidden test stays hidden, or appears later if it has a tag of `LATER`. A test that could not be graded
    has no score. Signals for staff are left out; staff can see the output of the run.
    """
    rows = for_platform(grade)
    shown = album(rows, pictures, MOST_PICTURES)
    return encoded(
        {
            "score": rounded(grade.score),
            "execution_time": rounded(grade.timings.seconds, 3),
            "output": " ".join(filter(None, (headline(grade), shown.note))),
            "output_format": "text",
            "test_output_format": "text",
            "test_name_format": "text",
            "visibility": "visible",
            "stdout_visibility": "hidden",
            "extra_data": {"schema": grade.schema_, "tool": grade.tool.model_dump()},
            "tests": [
                _judged(row) | _details(row, test) | _output(row, shown.of(row))
                for row, test in zip_longest(rows, grade.tests)
            ],
        }
    )


def _judged(row: Row) -> dict[str, Any]:
    judged = {"score": rounded(row.points), "status": "passed" if row.status == "passed" else "failed"}
    named = {"max_score": rounded(row.max_points), "name": row.name, "name_format": "text"}
    return named if row.open else judged | named


def _details(row: Row, test: TestGrade | None) -> dict[str, Any]:
    """The fields that only tests have; points lost by lateness are a row without a test."""
    if test is None:
        return {"visibility": "visible"}
    value = None if test.value is None else significant(test.value)
    return {
        "tags": _tags(row, test),
        "visibility": _visibility(test),
        "extra_data": {"id": test.id, "metric": test.metric, "value": value},
    }


def _tags(row: Row, test: TestGrade) -> list[str]:
    added = [word for word, holds in (("bonus", test.bonus), ("not-gradable", row.open)) if holds]
    return [*(line(tag) for tag in test.tags), *added]


def _visibility(test: TestGrade) -> str:
    if not test.hidden:
        return "visible"
    return next((tag for tag in LATER if tag in test.tags), "hidden")


def _output(row: Row, pictures: Sequence[Shown]) -> dict[str, str]:
    if not pictures:
        return {"output": row.message, "output_format": "text"}
    words = "<br>".join(html.escape(row.message).splitlines())
    figures = "".join(
        f'<p>{label}<br><img src="{picture.url}" alt="{html.escape(row.name)}: {label}"></p>'
        for picture in pictures
        for label in [html.escape(picture.label)]
    )
    return {"output": f"<p>{words}</p>{figures}", "output_format": "html"}
