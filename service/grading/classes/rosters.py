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

GROUP = "Group"
"""Column of Moodle's worksheet where groups submit: their downloads have the name and number of the group."""

MOODLE_POINTS = "Grade"

MOODLE_TIMES = ("%A, %d %B %Y, %I:%M %p", "%A, %B %d, %Y, %I:%M %p")
"""Times of Moodle in English, of the world and of the United States: Saturday, 21 November 2026, 8:15 PM."""

EXCUSED = "EX"
"""Canvas' points of a student who is excused."""

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
        The name or number of each row, empty in rows of another kind; or the name of its group.
    in_groups : bool
        Whether groups submit.
    times : tuple of str or None
        The time of each submission, ISO 8601.
    separator : str
    encoding : str
        UTF-8, with a byte order mark or without.
    """

    columns: tuple[str, ...]
    rows: tuple[dict[str, str], ...]
    students: tuple[str, ...]
    in_groups: bool
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
        in_groups = name == "Identifier" and GROUP in columns
        found = (PARTICIPANT.sub("", (row[GROUP if in_groups else name] or "").strip()) for row in rows)
        times = [None if time == name else _moment(row[time] or "", at) for at, row in enumerate(rows, 2)]
        encoding = "utf-8-sig" if content.startswith(BOM_UTF8) else "utf-8"
        separator = reader.reader.dialect.delimiter
        return cls(columns, rows, tuple(found), in_groups, tuple(times), separator, encoding)

    def places(self, student: Student) -> list[int]:
        """The row of a student, or those of the members of a group."""
        # Moodle numbers groups and participants apart.
        is_meant = student.is_group if self.in_groups else student.is_called
        return [at for at, name in enumerate(self.students) if is_meant(name)]

    def submitted(self, student: Student) -> str | None:
        """The time of a submission; None if it is not in the table."""
        return next((self.times[at] for at in self.places(student)), None)

    def filled(self, grades: Mapping[Student, Grade], title: str) -> bytes | None:
        """The same table with points; None if it has no column for those of the assignment.

        Rows without a submission keep what they have, as do those whose points are not final, and students
        who are excused.
        """
        # Canvas adds a number to the title.
        column = re.compile(rf"{MOODLE_POINTS}|{re.escape(title)}(?: \(\d+\))?")
        name = next(filter(column.fullmatch, self.columns), None)
        if name is None:
            return None
        closed = ((student, grade) for student, grade in grades.items() if not grade.is_open)
        final = {at: rounded(grade.score) for student, grade in closed for at in self.places(student)}
        text = io.StringIO(newline="")
        writer = csv.DictWriter(text, self.columns, delimiter=self.separator)
        writer.writeheader()
        for at, row in enumerate(self.rows):
            points = EXCUSED if row[name] == EXCUSED else final.get(at, row[name])
            writer.writerow(row | {name: points})
        return text.getvalue().encode(self.encoding)


def _moment(text: str, row: int) -> str | None:
    if text.strip() in {"", "-"}:
        return None
    with suppress(ValueError):
        return datetime.fromisoformat(text.strip()).isoformat()
    for form in MOODLE_TIMES:
        with suppress(ValueError):
            return datetime.strptime(text.strip(), form).isoformat()  # noqa: DTZ007 - that of the deadline
    raise AdjustmentError(f"row {row}: {text!r} is no time. Write it as 2026-11-21T20:15:00+01:00.")
