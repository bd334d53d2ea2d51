"""Gradebooks as CSV (RFC 4180) in UTF-8: a header and the row of one submission, or those of a class."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

from schemas.grading.classes import ClassGrade, SharedFiles, SharedNoise
from schemas.grading.grades import Grade
from service.grading.exports.rows import Row, for_staff, for_students
from service.grading.exports.texts import line, rounded

Cells = dict[str, str | float]
"""A row, by column."""

FORMULA = re.compile("(^|[;,|])(?=[\\s\"']*[-=+@\uff1d\uff0b\uff0d\uff20])")
"""Characters that begin a formula in spreadsheets, also in full width: at the beginning of a cell, and
after each character at which they may split it (https://owasp.org/www-community/attacks/CSV_Injection)."""


def for_gradebook(grade: Grade, _pictures: Path | None = None) -> bytes:
    """Export the row that students may see: hidden tests share one column. Pictures are not supported."""
    return _written([_cells(grade, for_students(grade), {})])


def with_signals(grade: Grade, _pictures: Path | None = None) -> bytes:
    """Export the row for staff: one column for each test, and the signals in the last one."""
    return _written([_cells(grade, for_staff(grade), {"signals": _signals(grade)})])


def for_class(grades: Sequence[Grade], whole: ClassGrade) -> bytes:
    """The gradebook of a class, for staff: a row for each submission, in their order.

    It begins with a byte order mark, without which Excel reads names in another encoding.
    """
    rows = []
    for grade in grades:
        signals = {
            "signals": _signals(grade),
            "same_files_as": _others(grade, whole.shared_files),
            "same_noise_as": _others(grade, whole.shared_noise),
        }
        rows.append(_cells(grade, for_staff(grade), signals))
    return _written(rows, "utf-8-sig")


def _others(grade: Grade, shared: Sequence[SharedFiles | SharedNoise]) -> str:
    """The other students of a student's groups, with the tests."""
    return "; ".join(
        f"{other}: {', '.join(group.tests)}"
        for group in shared
        if grade.student in group.students
        for other in group.students
        if other != grade.student
    )


def _signals(grade: Grade) -> str:
    return "; ".join(f"{signal.test}: {signal.code}" for signal in grade.signals)


def _cells(grade: Grade, rows: Sequence[Row], more: dict[str, str]) -> Cells:
    cells: Cells = {
        "student": grade.student or "",
        "submitted": grade.submitted or "",
        "assignment": grade.title,
        # A partial total could be mistaken for the final one; bonus points may stay open.
        "score": "" if grade.is_open else rounded(grade.score),
        "max_score": rounded(grade.max_score),
        "earned": rounded(grade.earned),
        "days_late": grade.late.days if grade.late else 0,
        "ungraded": len(grade.ungraded),
    }
    cells |= {
        f"points_{row.id or 'hidden'}": "" if row.open else rounded(row.points)
        for row in rows
        if not row.is_deduction
    }
    return cells | more


def _written(rows: Sequence[Cells], encoding: str = "utf-8") -> bytes:
    """A table; all rows have the columns of the first."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(rows[0])
    writer.writerows([_safe(cell) for cell in row.values()] for row in rows)
    return text.getvalue().encode(encoding)


def _safe(cell: str | float) -> str | float:
    return FORMULA.sub(r"\1'", line(cell)) if isinstance(cell, str) else cell
