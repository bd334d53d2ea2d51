"""A roster: the students of a class in a CSV file, such as the one that Canvas or Moodle exports.

It gives times of submission, and takes the points in the form that the same system imports.
"""

from __future__ import annotations

import csv
import io
import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

from schemas.grading.grades import Grade
from service.grading.adjustments import table
from service.grading.classes.class_records import Student
from service.grading.errors import AdjustmentError
from service.grading.exports.texts import rounded

IDS = ("student", "Identifier", "ID")
"""Columns that name a student: of any table, of Moodle's grading worksheet, of Canvas' gradebook."""

TIMES = ("submitted_at", "Last modified (submission)")
"""Columns with times of submission: of any table, and of Moodle's grading worksheet."""

MOODLE_POINTS = "Grade"

MOODLE_TIME = "%A, %d %B %Y, %I:%M %p"
"""Times of Moodle in English: Saturday, 21 November 2026, 8:15 PM."""

PARTICIPANT = re.compile(r"Participant (\d+)")
"""Moodle's identifier of a submission; names of downloaded files have the number alone."""


@dataclass(frozen=True, slots=True)
class Roster:
    """A table of students.

    Attributes
    ----------
    columns : tuple of str
    rows : tuple of dict
        By column.
    separator : str
    encoding : str
        UTF-8, with a byte order mark or without.
    key : str
        The column that names a student.
    """

    columns: tuple[str, ...]
    rows: tuple[dict[str, str], ...]
    separator: str
    encoding: str
    key: str

    @classmethod
    def read(cls, content: bytes) -> Roster:
        """Read a CSV file.

        Raises
        ------
        AdjustmentError
            No column names the students, or a time cannot be read.
        """
        reader = table(content)
        columns = tuple(reader.fieldnames or ())
        key = next((name for name in IDS if name in columns), None)
        if key is None:
            raise AdjustmentError(f"no column names the students. Name one of its columns {IDS[0]}.")
        encoding = "utf-8-sig" if content.startswith(BOM_UTF8) else "utf-8"
        roster = cls(columns, tuple(reader), str(reader.reader.dialect.delimiter), encoding, key)
        if any(None in row for row in roster.rows):
            raise AdjustmentError("a row has more cells than the first one.")
        for number, row in enumerate(roster.rows, 2):
            try:
                roster._time(row)
            except ValueError as error:
                raise AdjustmentError(f"row {number}: {error}") from error
        return roster

    @property
    def students(self) -> tuple[str, ...]:
        """The names or numbers of all students."""
        return tuple(filter(None, map(self._name, self.rows)))

    def row_of(self, student: Student) -> dict[str, str] | None:
        """The row of a student."""
        return next((row for row in self.rows if student.is_called(self._name(row))), None)

    def submitted(self, student: Student) -> str | None:
        """The time of a submission, ISO 8601; None if it is not in the table."""
        row = self.row_of(student)
        return None if row is None else self._time(row)

    def filled(self, grades: Mapping[Student, Grade], title: str) -> bytes | None:
        """The same table with points; None if it has no column for those of the assignment.

        Rows without a submission keep what they have, as do those whose points are not final.
        """
        names = (name for name in self.columns if name == MOODLE_POINTS or _is_of(name, title))
        column = next(names, None)
        if column is None:
            return None
        points = {id(row): rounded(grade.score) for row, grade in self._final(grades)}
        text = io.StringIO(newline="")
        writer = csv.DictWriter(text, self.columns, delimiter=self.separator)
        writer.writeheader()
        writer.writerows(row | ({column: points[id(row)]} if id(row) in points else {}) for row in self.rows)
        return text.getvalue().encode(self.encoding)

    def _final(self, grades: Mapping[Student, Grade]) -> Iterator[tuple[dict[str, str], Grade]]:
        for student, grade in grades.items():
            row = self.row_of(student)
            if row is not None and not grade.is_open:
                yield row, grade

    def _name(self, row: Mapping[str, str]) -> str:
        name = (row[self.key] or "").strip()
        found = PARTICIPANT.fullmatch(name)
        return found[1] if found else name

    def _time(self, row: Mapping[str, str]) -> str | None:
        text = next(((row[name] or "").strip() for name in TIMES if name in self.columns), "")
        if text in {"", "-"}:
            return None
        try:
            return datetime.fromisoformat(text).isoformat()
        except ValueError:
            pass
        try:
            return datetime.strptime(text, MOODLE_TIME).isoformat()  # noqa: DTZ007 - the deadline has the zone
        except ValueError:
            raise ValueError(f"{text!r} is no time. Write it as 2026-11-21T20:15:00+01:00.") from None


def _is_of(column: str, title: str) -> bool:
    """Whether a column of Canvas' gradebook is that of an assignment: its title, and its number there."""
    return re.fullmatch(rf"{re.escape(title)}( \(\d+\))?", column) is not None
