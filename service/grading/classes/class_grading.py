"""Grade the submissions of a class: references are rendered once, and all tests share the processes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from schemas.grading.classes import ClassEntry, ClassGrade, NotCompared, SharedFiles, SharedNoise
from schemas.grading.grades import Grade, GradeTimings
from schemas.grading.manifests import Manifest
from service.grading import results
from service.grading.classes.class_records import Student
from service.grading.folders import Folder
from service.grading.grading import errands_of, pictures_of, prepare_references, reference_folder
from service.grading.likeness.fingerprints import Fingerprint
from service.grading.processes import Errand, Finished, run_all
from service.grading.settings import Run
from service.grading.variants import references_for

BETWEEN = "/"
"""Between the number of a student and the id of a test, which cannot contain it."""


@dataclass(frozen=True, slots=True)
class StudentResult:
    """The result of a submission.

    Attributes
    ----------
    student : Student
    grade : Grade
    pictures : dict of str to bytes
        PNG files, by the names in the grade.
    prints : dict of str to Fingerprint
        Of the submitted pictures, by test.
    """

    student: Student
    grade: Grade
    pictures: dict[str, bytes]
    prints: dict[str, Fingerprint]


@dataclass(slots=True)
class _Progress:
    """A student's tests that are done."""

    student: Student
    started: datetime
    tests: dict[str, results.Tested] = field(default_factory=dict)
    cpu_seconds: float = 0.0

    def add(self, manifest: Manifest, test_id: str, finished: Finished) -> None:
        """Record a test."""
        (test,) = (test for test in manifest.tests if test.id == test_id)
        self.tests[test_id] = results.tested(test, finished)
        self.cpu_seconds += finished.cpu_seconds

    def result(self, manifest: Manifest) -> StudentResult:
        """The whole result."""
        in_order = [self.tests[test.id] for test in manifest.tests]
        timings = GradeTimings(
            # Tests of several students run side by side, so the time between first and last means nothing.
            seconds=sum(tested.grade.seconds for tested in in_order),
            cpu_seconds=self.cpu_seconds,
            started=self.started.isoformat(timespec="seconds"),
        )
        grade = results.graded(
            manifest,
            in_order,
            timings,
            student=self.student.name,
            submitted=self.student.submitted,
            corrections=self.student.corrections,
        )
        prints = {test.grade.id: test.fingerprint for test in in_order if test.fingerprint is not None}
        return StudentResult(self.student, grade, pictures_of(in_order), prints)


def grade_class(
    manifest: Manifest,
    students: Sequence[Student],
    *,
    references: Path,
    jobs: int = 1,
    server: str | None = None,
    cache: Path | None = None,
    on_test: Callable[[Student], None] | None = None,
) -> Generator[StudentResult, None, None]:
    """Grade submissions, and yield the result of each as soon as its last test is done.

    Parameters
    ----------
    students
        The submissions; no file outside of their folders and `references` is opened.
    references, jobs, server, cache
        As in `service.grading.grading.grade`.
    on_test
        Called after each test with its student.

    Notes
    -----
    When the generator is closed, running tests are killed. What it has yielded is complete.
    """
    # References depend on the submission only where scenes differ from student to student.
    groups = [students] if manifest.per_student is None else [[student] for student in students]
    with reference_folder(cache) as folder:
        for group in filter(None, groups):
            beside = references_for(manifest, references, group[0].id)
            run = Run(manifest, beside, _submission(group[0]), server, pictures=True)
            yield from _grade_group(run, group, jobs, folder, on_test)


def _grade_group(
    run: Run,
    students: Sequence[Student],
    jobs: int,
    folder: Path,
    on_test: Callable[[Student], None] | None,
) -> Iterator[StudentResult]:
    """Grade submissions with the same references, which a folder keeps."""
    prepared, _ = prepare_references(run, jobs, folder)
    with tempfile.TemporaryDirectory(prefix="penumbra-class-") as keep:
        run = replace(run, prepared=prepared, keep=Path(keep))
        started = datetime.now(UTC)
        open_ = {number: _Progress(student, started) for number, student in enumerate(students)}
        for name, finished in run_all(_errands(run, students), jobs):
            number, _, test_id = name.partition(BETWEEN)
            done = open_[int(number)]
            done.add(run.manifest, test_id, finished)
            if on_test is not None:
                on_test(done.student)
            if len(done.tests) == len(run.manifest.tests):
                yield open_.pop(int(number)).result(run.manifest)


def _errands(run: Run, students: Sequence[Student]) -> list[Errand]:
    """The tests of all students, student by student, so that results are complete early."""
    return [
        errand
        for number, student in enumerate(students)
        for errand in errands_of(replace(run, submission=_submission(student)), f"{number}{BETWEEN}")
    ]


def _submission(student: Student) -> Folder:
    return Folder(student.folder.resolve(), "submission")


STUDENTS = "students"
"""The folder with a folder for each student."""


def of_class(
    title: str,
    grades: Mapping[Student, Grade],
    *,
    files: Sequence[SharedFiles] = (),
    noise: Sequence[SharedNoise] = (),
    not_compared: Sequence[NotCompared] = (),
    left_out: Sequence[str] = (),
) -> ClassGrade:
    """The result of a class of at least one student."""
    return ClassGrade(
        title=title,
        max_score=next(iter(grades.values())).max_score,
        students=tuple(_entry(student, grade) for student, grade in grades.items()),
        shared_files=tuple(files),
        shared_noise=tuple(noise),
        not_compared=tuple(not_compared),
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
        late=grade.late,
        overridden=tuple(test.id for test in grade.tests if test.override is not None),
        signals=grade.signals,
    )
