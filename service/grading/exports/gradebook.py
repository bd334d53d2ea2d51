"""A row of a gradebook with its header, CSV (RFC 4180) in UTF-8."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from schemas.grading.grades import Grade
from service.grading.exports.rows import Row, for_staff, for_students
from service.grading.exports.texts import line

FORMULA = tuple("=+-@\uff1d\uff0b\uff0d\uff20")
"""A spreadsheet computes a cell that begins so, or with the same signs in full width
(https://owasp.org/www-community/attacks/CSV_Injection)."""


def for_gradebook(grade: Grade, pictures: Path | None = None) -> bytes:
    """The row that students may see: hidden tests are one column. Pictures have no place there."""
    del pictures
    return _table(grade, for_students(grade), {})


def with_signals(grade: Grade, pictures: Path | None = None) -> bytes:
    """The row for staff: every test has its column, and the last one has the signals."""
    del pictures
    signals = "; ".join(f"{signal.test}: {signal.code}" for signal in grade.signals)
    return _table(grade, for_staff(grade), {"signals": signals})


def _table(grade: Grade, rows: Sequence[Row], more: dict[str, str]) -> bytes:
    cells: dict[str, str | float] = {
        "student": grade.student or "",
        "submitted": grade.submitted or "",
        "assignment": grade.title,
        # A total without what is open would be taken for the whole.
        "score": "" if grade.ungraded else grade.score,
        "max_score": grade.max_score,
        "ungraded": len(grade.ungraded),
    }
    cells |= {f"points_{row.id or 'hidden'}": "" if row.open else row.points for row in rows}
    cells |= more
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(cells)
    writer.writerow([_safe(cell) for cell in cells.values()])
    return text.getvalue().encode()


def _safe(cell: str | float) -> str | float:
    if not isinstance(cell, str):
        return cell
    words = line(cell)
    return f"'{words}" if words.startswith(FORMULA) else words
