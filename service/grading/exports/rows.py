"""The tests of a result as rows, for staff and for students."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from schemas.grading.grades import Feedback, Grade, GradeImage, Status, TestGrade
from service.grading.exports.texts import harmless, line, number
from service.grading.sentences import joined, place

OPEN: frozenset[Status] = frozenset({"error", "not_gradable"})
"""Statuses of rows that were not judged."""

WORDS: dict[Status, str] = {
    "passed": "passed",
    "partial": "partly",
    "failed": "failed",
    "error": "could not be graded",
    "not_gradable": "could not be graded",
    "skipped": "not submitted",
}


@dataclass(frozen=True, slots=True)
class Row:
    """One test, with all untrusted text sanitized.

    Attributes
    ----------
    id : str
        Empty for the row that sums up all hidden tests.
    places : tuple of str
        Sentences about the regions that differ most, worst first.
    test : TestGrade or None
        The test itself; None where its numbers are not shown.
    """

    id: str
    name: str
    points: float
    max_points: float
    status: Status
    message: str
    places: tuple[str, ...] = ()
    images: tuple[GradeImage, ...] = ()
    seconds: float = 0.0
    test: TestGrade | None = None

    @property
    def open(self) -> bool:
        """Whether the test could not be graded."""
        return self.status in OPEN

    @property
    def result(self) -> str:
        """The status in words."""
        if self.test is not None and self.test.override is not None:
            return f"{WORDS[self.status]}, set by staff"
        return "deducted" if self.is_deduction else WORDS[self.status]

    @property
    def total(self) -> str:
        """The points in words."""
        if self.is_deduction:
            return number(self.points)
        return "–" if self.open else f"{number(self.points)} of {number(self.max_points)}"

    @property
    def is_deduction(self) -> bool:
        """Whether it is no test, but the points that the submission lost by lateness."""
        return self.points < 0

    @property
    def lost(self) -> float:
        """Points not earned."""
        return max(self.max_points - self.points, 0.0)


def for_staff(grade: Grade) -> tuple[Row, ...]:
    """All tests."""
    return (*(_row(test, "picture") for test in grade.tests), *_deduction(grade))


def for_platform(grade: Grade) -> tuple[Row, ...]:
    """All tests with what students may see of each, for a platform that hides tests itself."""
    return (*(_row(test, test.feedback) for test in grade.tests), *_deduction(grade))


def for_students(grade: Grade) -> tuple[Row, ...]:
    """Visible tests, and one row for all hidden ones: their sum follows from the total anyway."""
    hidden = [test for test in grade.tests if test.hidden]
    shown = tuple(_row(test, test.feedback) for test in grade.tests if not test.hidden)
    return (*shown, *([_together(hidden)] if hidden else ()), *_deduction(grade))


def _deduction(grade: Grade) -> Iterator[Row]:
    """The points lost by lateness, as a row."""
    if grade.late is not None and grade.late.points > 0:
        days = "1 day" if grade.late.days == 1 else f"{grade.late.days} days"
        yield Row(
            id="",
            name=f"Late by {days}",
            points=-grade.late.points,
            max_points=0.0,
            status="failed",
            message=f"The deadline was {grade.late.deadline}, the submission is of {grade.submitted}. Each "
            "day begun costs points; the tests show what was earned.",
        )


def headline(grade: Grade) -> str:
    """One or two sentences with the total."""
    left = [test for test in grade.tests if test.is_open]
    if not grade.gradable:
        return "Nothing could be graded, and no points are lost. The tests say why."
    total = f"{number(grade.score)} of {number(grade.max_score)} points."
    if grade.late is not None and grade.late.points > 0:
        total += f" {number(grade.earned)} were earned, and {number(grade.late.points)} are lost by lateness."
    if not left:
        return total
    points = number(sum(test.max_points for test in left))
    counted = "1 test" if len(left) == 1 else f"{len(left)} tests"
    return f"{total} {counted} could not be graded: {points} points are open, not lost."


def _row(test: TestGrade, feedback: Feedback) -> Row:
    explained = feedback in {"difference", "picture"}
    # Why a test was not judged tells nothing of its reference.
    unjudged = test.is_open or test.status == "skipped"
    message = test.message if explained or unjudged else _verdict(test, feedback)
    if test.override is not None:
        before = "not graded" if test.override.status in OPEN else number(test.override.points)
        message = joined(f"Staff set these points (before: {before}). {test.override.reason}", message)
    places = test.worst_regions if explained and test.status != "passed" else ()
    return Row(
        id=test.id,
        name=line(test.name) + (" (bonus)" if test.bonus else ""),
        points=test.points,
        max_points=test.max_points,
        status=test.status,
        message=harmless(message),
        places=tuple(line(place(region)) for region in places),
        images=tuple(image for image in test.images if image.feedback == feedback),
        seconds=test.seconds,
        test=test if explained else None,
    )


def _verdict(test: TestGrade, feedback: Feedback) -> str:
    return f"This test is {WORDS[test.status]}." if feedback == "verdict" else ""


def _together(hidden: Sequence[TestGrade]) -> Row:
    return Row(
        id="",
        name="Hidden tests",
        points=math.fsum(test.points for test in hidden),
        max_points=math.fsum(test.max_points for test in hidden),
        status=_status([test.status for test in hidden]),
        message=f"{len(hidden)} of the tests {'is' if len(hidden) == 1 else 'are'} not shown.",
    )


def _status(statuses: Sequence[Status]) -> Status:
    if set(statuses) == {"passed"}:
        return "passed"
    if not OPEN.isdisjoint(statuses):
        return "not_gradable"
    return "failed" if {"passed", "partial"}.isdisjoint(statuses) else "partial"
