"""``results.json`` of a PrairieLearn external grader.

Fields and limits: https://prairielearn.readthedocs.io/en/latest/externalGrading/
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from schemas.grading.grades import Grade
from service.grading.exports.pictures import Album, Shown, album
from service.grading.exports.rows import Row, for_students, headline
from service.grading.exports.texts import encoded, number, rounded, shortened

MOST = 1_000_000
"""Largest file in bytes: the limit of PrairieLearn is 1 MB."""

LENGTHS = (4000, 1000, 250)
"""Lengths to which messages are cut, tried in order; with the last one 200 tests always fit."""


def export(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export a result for PrairieLearn, with at most `MOST` bytes.

    If a test could not be graded, the whole submission is not gradable and costs no points and no attempt.
    It only says why then: attempts that cost nothing must not tell the rest. A bonus test withholds no score.
    """
    rows = for_students(grade)
    if not _gradable(grade):
        rows, pictures = tuple(row for row in rows if row.open), None
    bare = [(length, len(_content(grade, rows, Album(), length))) for length in LENGTHS]
    length, size = next((tried for tried in bare if tried[1] <= MOST), bare[-1])
    return _content(grade, rows, album(rows, pictures, MOST - size), length)


def _content(grade: Grade, rows: Sequence[Row], shown: Album, length: int) -> bytes:
    message = " ".join(filter(None, (headline(grade), _bonus(grade), shown.note)))
    return encoded(
        {"gradable": _gradable(grade)}
        | _judged(grade, rows, length)
        | {
            "message": message,
            "output": "",
            "images": [],
            "tests": [_test(row, shown.of(row), length) for row in rows],
        }
    )


def _gradable(grade: Grade) -> bool:
    """Whether the score stands: bonus points may stay open, those of the full score may not."""
    return grade.gradable and not grade.is_open


def _judged(grade: Grade, rows: Sequence[Row], length: int) -> dict[str, Any]:
    if _gradable(grade):
        return {"score": _share(grade)}
    reasons = [f"{row.name}: {shortened(row.message, length)}" for row in rows if row.open]
    return {"format_errors": reasons}


def _share(grade: Grade) -> float:
    # Where all tests are a bonus they are the whole.
    most = grade.max_score or sum(test.max_points for test in grade.tests)
    return rounded(min(grade.score / most, 1.0), 6) if most > 0 else 1.0


def _bonus(grade: Grade) -> str:
    if grade.score <= grade.max_score:
        return ""
    return f"PrairieLearn accepts no more than the full score; {number(grade.score)} points were earned."


def _test(row: Row, pictures: Sequence[Shown], length: int) -> dict[str, Any]:
    return {
        "name": row.name,
        "points": rounded(row.points),
        "max_points": rounded(row.max_points),
        "message": shortened(row.message, length),
        "output": shortened("\n".join(row.places), length),
        "images": [{"label": picture.label, "url": picture.url} for picture in pictures],
    }
