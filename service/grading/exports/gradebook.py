"""Gradebook rows: a header and one row as CSV (RFC 4180) in UTF-8."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from schemas.grading.grades import Grade
from service.grading.exports.rows import Row, for_staff, for_students
from service.grading.exports.texts import line, rounded

FORMULA = tuple("=+-@\uff1d\uff0b\uff0d\uff20")
"""Spreadsheets evaluate cells that begin with these characters, also in full width
(https://owasp.org/www-community/attacks/CSV_Injection)."""


def for_gradebook(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export the row that students may see: hidden tests share one column. Pictures are not supported."""
    del pictures
    return _table(grade, for_students(grade), {})


def with_signals(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export the row for staff: one column for each test, and the signals in the last one."""
    del pictures
    signals = "; ".join(f"{signal.test}: {signal.code}" for signal in grade.signals)
    return _table(grade, for_staff(grade), {"signals": signals})


def _table(grade: Grade, rows: Sequence[Row], more: dict[str, str]) -> bytes:
    cells: dict[str, str | float] = {
        "student": grade.student or "",
        "submitted": grade.submitted or "",
        "assignment": grade.title,
        # A partial total could be mistaken for the final one.
        "score": "" if grade.ungraded else rounded(grade.score),
        "max_score": rounded(grade.max_score),
        "ungraded": len(grade.ungraded),
    }
    cells |= {f"points_{row.id or 'hidden'}": "" if row.open else rounded(row.points) for row in rows}
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
