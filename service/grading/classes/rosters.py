"""A roster: the students of a class in a CSV file, such as the one that Canvas or Moodle exports.

It gives times of submission, and takes the points in the form that the same system imports.
"""

from __future__ import annotations

import csv
import io
import re
from codecs import BOM_UTF8
from collections.abc import Mapping
from contextlib import suppress
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

PARTICIPANT = re.compile(r"^Participant (?=\d+$)")
"""Moodle's identifier of a submission; names of downloaded files have the number alone."""


@dataclass(frozen=True, slots=True)
class Roster:
    """A table of students.

    Attributes
    ----------
    columns : tuple of str
    rows : tuple of dict
        By column.
    students : tuple of str
        The name or number of each row; empty in rows of another kind.
    times : tuple of str or None
        The time of each submission, ISO 8601.
    separator : str
    encoding : str
        UTF-8, with a byte order mark or without.
    """

    columns: tuple[str, ...]
    rows: tuple[dict[str, str], ...]
    students: tuple[str, ...]
    times: tuple[str | None, ...]
    separator: str
    encoding: str

    @classmethod
    def read(cls, content: bytes) -> Roster:
        """Read a CSV file.

        Raises
        ------
        AdjustmentError
            No column names the students, or a time cannot be read.
        """
        reader = table(content)
        columns, rows = tuple(reader.fieldnames or ()), tuple(reader)
        name = next((name for name in IDS if name in columns), None)
        if name is None or any(None in row for row in rows):
            reason = f"no column is called {' or '.join(IDS)}" if name is None else "a row is too long"
            raise AdjustmentError(f"{reason}. Give a table with a row for each student.")
        time = next((time for time in TIMES if time in columns), name)
        found = (PARTICIPANT.sub("", (row[name] or "").strip()) for row in rows)
        times = [None if time == name else _moment(row[time] or "", at) for at, row in enumerate(rows, 2)]
        encoding = "utf-8-sig" if content.startswith(BOM_UTF8) else "utf-8"
        return cls(columns, rows, tuple(found), tuple(times), reader.reader.dialect.delimiter, encoding)

    def place(self, student: Student) -> int | None:
        """The row of a student."""
        return next((at for at, name in enumerate(self.students) if student.is_called(name)), None)

    def submitted(self, student: Student) -> str | None:
        """The time of a submission; None if it is not in the table."""
        place = self.place(student)
        return None if place is None else self.times[place]

    def filled(self, grades: Mapping[Student, Grade], title: str) -> bytes | None:
        """The same table with points; None if it has no column for those of the assignment.

        Rows without a submission keep what they have, as do those whose points are not final.
        """
        # Canvas adds a number to the title.
        column = re.compile(rf"{MOODLE_POINTS}|{re.escape(title)}(?: \(\d+\))?")
        name = next(filter(column.fullmatch, self.columns), None)
        if name is None:
            return None
        final = {self.place(student): grade for student, grade in grades.items() if not grade.is_open}
        text = io.StringIO(newline="")
        writer = csv.DictWriter(text, self.columns, delimiter=self.separator)
        writer.writeheader()
        for at, row in enumerate(self.rows):
            writer.writerow(row | ({name: rounded(final[at].score)} if at in final else {}))
        return text.getvalue().encode(self.encoding)


def _moment(text: str, row: int) -> str | None:
    if text.strip() in {"", "-"}:
        return None
    for read in (datetime.fromisoformat, lambda text: datetime.strptime(text, MOODLE_TIME)):  # noqa: DTZ007
        with suppress(ValueError):
            return read(text.strip()).isoformat()
    raise AdjustmentError(f"row {row}: {text!r} is no time. Write it as 2026-11-21T20:15:00+01:00.")
