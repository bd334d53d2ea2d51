"""Grade the submissions of a class: references are rendered once, and all tests share the processes."""

from __future__ import annotations

import os
import tempfile
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from schemas.grading.classes import ClassEntry, ClassGrade, NotCompared, SharedFiles, SharedNoise
from schemas.grading.grades import Grade, GradeTimings
from schemas.grading.manifests import Manifest
from service.grading import results
from service.grading.classes.class_records import Student
from service.grading.folders import Folder
from service.grading.grading import Graded, assembled, errands_of, prepare_references, reference_folder
from service.grading.processes import Errand, run_all
from service.grading.settings import Run
from service.grading.variants import references_for

BETWEEN = "/"
"""Between the number of a student and the id of a test, which cannot contain it."""


def grade_class(
    manifest: Manifest,
    students: Sequence[Student],
    *,
    references: Path,
    jobs: int = 1,
    server: str | None = None,
    cache: Path | None = None,
    on_test: Callable[[Student], None] | None = None,
) -> Generator[tuple[Student, Graded], None, None]:
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
) -> Iterator[tuple[Student, Graded]]:
    """Grade submissions with the same references, which a folder keeps."""
    prepared, _ = prepare_references(run, jobs, folder)
    tests = {test.id: test for test in run.manifest.tests}
    with tempfile.TemporaryDirectory(prefix="penumbra-class-") as keep:
        run = replace(run, prepared=prepared, keep=Path(keep))
        started, open_ = datetime.now(UTC), defaultdict[int, dict[str, results.Tested]](dict)
        for name, finished in run_all(_errands(run, students), jobs):
            number, _, test_id = name.partition(BETWEEN)
            place = int(number)
            open_[place][test_id] = results.tested(tests[test_id], finished)
            if on_test is not None:
                on_test(students[place])
            if len(open_[place]) == len(tests):
                yield students[place], _graded(run.manifest, students[place], open_.pop(place), started)


def _graded(
    manifest: Manifest, student: Student, done: Mapping[str, results.Tested], started: datetime
) -> Graded:
    timings = GradeTimings(
        # Tests of several students run side by side, so the time between first and last means nothing.
        seconds=sum(tested.grade.seconds for tested in done.values()),
        cpu_seconds=sum(tested.grade.cpu_seconds for tested in done.values()),
        started=started.isoformat(timespec="seconds"),
    )
    return assembled(manifest, done, timings, student.name, student.submitted, student.corrections)


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
