"""Adjustments by staff: points that they set by hand, and those that a late submission loses."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from schemas.grading.grades import Lateness, Override, Status, TestGrade
from schemas.grading.manifests import LatePolicy, Manifest
from service.grading.errors import AdjustmentError

DAY = timedelta(days=1)

COLUMNS = ("student", "test", "points", "reason")


@dataclass(frozen=True, slots=True)
class Correction:
    """Points that staff give a student in a test, in place of those that were graded."""

    student: str
    test: str
    points: float
    reason: str
    # The record of a graded submission must not change when a row moves.
    line: int = field(repr=False)


def read_corrections(content: bytes, manifest: Manifest) -> tuple[Correction, ...]:
    """Read a CSV file with the columns of `COLUMNS`, a row for each correction.

    Raises
    ------
    AdjustmentError
        It is no such table, names an unknown test, or gives points that the test does not have.
    """
    reader = table(content)
    missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
    if missing:
        raise AdjustmentError(f"line 1 lacks {', '.join(missing)}. Its columns are {', '.join(COLUMNS)}.")
    most, found = {test.id: test.points for test in manifest.tests}, dict[tuple[str, str], Correction]()
    for row in reader:
        where = f"line {reader.line_num}"
        student, test, points, reason = ((row[name] or "").strip() for name in COLUMNS)
        if test not in most:
            raise AdjustmentError(f"{where}: no test has the id {test!r}. Tests are {', '.join(most)}.")
        if not student or not reason or (student, test) in found:
            raise AdjustmentError(f"{where}: name a student and a reason, and each test of a student once.")
        given = _points(points, most[test], where)
        found[student, test] = Correction(student, test, given, reason, reader.line_num)
    return tuple(found.values())


def table(content: bytes) -> csv.DictReader[str]:
    """The rows of a CSV file, separated by commas, semicolons or tabs.

    Raises
    ------
    AdjustmentError
        It is not text in UTF-8.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise AdjustmentError("it is not text in UTF-8. Save it as 'CSV UTF-8'.") from error
    separator = max(",;\t", key=text.partition("\n")[0].count)
    return csv.DictReader(io.StringIO(text, newline=""), delimiter=separator)


def _points(text: str, most: float, where: str) -> float:
    try:
        points = float(text)
    except ValueError:
        points = math.nan
    if not 0 <= points <= most:
        raise AdjustmentError(f"{where}: {text!r} is not a number of points from 0 to {most:g}.")
    return points


def corrected(grade: TestGrade, corrections: Sequence[Correction]) -> TestGrade:
    """A grade with the points that staff gave instead, if they did."""
    correction = next((each for each in corrections if each.test == grade.id), None)
    if correction is None:
        return grade
    override = Override(reason=correction.reason, points=grade.points, status=grade.status)
    points, status = correction.points, status_of(correction.points / (grade.max_points or 1.0))
    return grade.model_copy(update={"points": points, "status": status, "override": override})


def status_of(share: float) -> Status:
    """The status of a test that earned this share of its points."""
    if share == 1.0:
        return "passed"
    return "partial" if share > 0 else "failed"


def lateness(policy: LatePolicy | None, submitted: str | None, full: float, earned: float) -> Lateness | None:
    """The points that a submission loses because it is late: at most those earned.

    Parameters
    ----------
    submitted
        ISO 8601; without a time zone it is in that of the deadline. If it is None nothing is lost.
    full
        The full score.
    """
    if policy is None or submitted is None:
        return None
    deadline, moment = (datetime.fromisoformat(text) for text in (policy.deadline, submitted))
    late = (moment if moment.tzinfo else moment.replace(tzinfo=deadline.tzinfo)) - deadline
    if late <= timedelta(minutes=policy.grace):
        return None
    days = -(-late // DAY)
    points = min(full * min(days * policy.per_day, policy.most), earned)
    return Lateness(deadline=policy.deadline, days=days, points=points)
