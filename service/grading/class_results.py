"""The result of a class from the results of its submissions."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from urllib.parse import quote

from schemas.grading.classes import ClassEntry, ClassGrade, SharedFiles
from schemas.grading.grades import Grade
from service.grading.class_records import Student

STUDENTS = "students"
"""The folder with a folder for each student."""


def of_class(title: str, max_score: float, graded: Sequence[tuple[Student, Grade]]) -> ClassGrade:
    """The result of a class."""
    return ClassGrade(
        title=title,
        max_score=max_score,
        students=tuple(_entry(student, grade) for student, grade in graded),
        shared_files=shared_files({student.name: grade for student, grade in graded}),
    )


def shared_files(grades: Mapping[str, Grade]) -> tuple[SharedFiles, ...]:
    """Groups of students who submitted the same bytes for a test; one entry for each group.

    Rendered pictures do not count: right scenes have the same one.
    """
    owners = defaultdict[tuple[str, str], set[str]](set)
    for student, grade in grades.items():
        for read in grade.inputs:
            if read.role == "submission" and read.size is not None and read.sha256 is not None:
                owners[read.test, read.sha256].add(student)
    groups = defaultdict[tuple[str, ...], list[str]](list)
    for (test, _), students in owners.items():
        if len(students) > 1:
            groups[tuple(sorted(students))].append(test)
    found = [SharedFiles(students=students, tests=tuple(sorted(tests))) for students, tests in groups.items()]
    return tuple(sorted(found, key=lambda shared: (-len(shared.tests), shared.students)))


def _entry(student: Student, grade: Grade) -> ClassEntry:
    return ClassEntry(
        student=student.name,
        folder=f"{STUDENTS}/{quote(os.fsencode(student.folder.name), safe='')}",
        score=grade.score,
        gradable=grade.gradable,
        ungraded=grade.ungraded,
        verdict=grade.verdict,
        signals=grade.signals,
    )
