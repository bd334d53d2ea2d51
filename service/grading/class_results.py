"""The result of a class from the results of its submissions."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from urllib.parse import quote

from schemas.grading.classes import ClassEntry, ClassGrade, SharedFiles, SharedNoise
from schemas.grading.grades import Grade
from service.grading.class_records import Student

STUDENTS = "students"
"""The folder with a folder for each student."""


def of_class(
    title: str,
    grades: Mapping[Student, Grade],
    *,
    files: Sequence[SharedFiles] = (),
    noise: Sequence[SharedNoise] = (),
    left_out: Sequence[str] = (),
) -> ClassGrade:
    """The result of a class of at least one student."""
    return ClassGrade(
        title=title,
        max_score=next(iter(grades.values())).max_score,
        students=tuple(_entry(student, grade) for student, grade in grades.items()),
        shared_files=tuple(files),
        shared_noise=tuple(noise),
        left_out=tuple(left_out),
    )


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
