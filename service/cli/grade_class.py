"""``penumbra grade --class``: grades the submissions of a class, and writes a gradebook and a page."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

from schemas.grading.classes import ClassGrade
from schemas.grading.grades import Grade
from schemas.grading.manifests import Manifest
from service.cli import output
from service.cli.errors import CommandError, ExitCode, InputError
from service.cli.progress import advancing, progress_bar
from service.cli.targets import make_folder, save, write_whole
from service.grading.adjustments import Correction
from service.grading.classes import class_grading
from service.grading.classes.class_grading import STUDENTS, of_class
from service.grading.classes.class_records import (
    KEY,
    PRINTS,
    Student,
    assignment_key,
    graded_before,
    last_written,
    packed,
    submission_key,
    submissions,
)
from service.grading.classes.class_records import RESULT as STUDENT_RESULT
from service.grading.classes.class_signals import shared_files, shared_noise
from service.grading.classes.downloads import sorted_download
from service.grading.classes.rosters import Roster
from service.grading.exports import EXPORTS
from service.grading.exports.class_page import class_page
from service.grading.exports.gradebook import for_class
from service.grading.exports.texts import number
from service.grading.grading import Graded

if TYPE_CHECKING:
    from service.cli.grade import GradeOptions

GRADEBOOK, PAGE, RESULT, ROSTER = "gradebook.csv", "index.html", "class.json", "roster.csv"
STAFF_PAGE = "staff.html"
SORTED = ".submissions"
"""Folder for the submissions of a download while they are graded. A killed run leaves it."""

HEADINGS = ("points", "submission", "not graded", "signals")

FOLDERS = "Put each submission into a folder of its own there; unpack archives."


@dataclass(frozen=True, slots=True)
class ClassRun:
    """Input of grading a class, and the destinations of its results.

    Attributes
    ----------
    options : GradeOptions
    manifest : Manifest
    folder : Path
        The folder of the class, with a folder for each submission.
    out : Path
    exports : mapping of str to str
        By form, the name of the file in each student's folder.
    roster : Roster or None
    corrections : sequence of Correction
    """

    options: GradeOptions
    manifest: Manifest
    folder: Path
    out: Path
    exports: Mapping[str, str]
    roster: Roster | None
    corrections: Sequence[Correction]

    def place(self, student: Student) -> Path:
        """The folder for the result of a student."""
        return self.out / STUDENTS / student.folder.name


def check_folders(folder: Path, out: Path | None) -> Path:
    """The folder for results.

    Raises
    ------
    CommandError
        There is none, or it is inside the class and would be graded itself.
    InputError
        The class is not a folder.
    """
    if out is None:
        raise CommandError("--class needs a folder for the results. Give it with -o.")
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder. Give the folder with a folder for each submission.")
    if out.resolve().is_relative_to(folder.resolve()):
        raise CommandError(f"{out} is inside {folder}, where each folder is a submission. Choose another.")
    return out


def file_names(words: Sequence[str]) -> dict[str, str]:
    """The name of each export in a student's folder, by form.

    Raises
    ------
    CommandError
        The form is unknown, or the name is not that of a new file.
    """
    taken = {KEY, PRINTS, STUDENT_RESULT, STAFF_PAGE}
    names = {}
    for word in words:
        form, _, name = word.partition("=")
        if form not in EXPORTS:
            raise CommandError(f"--export {word}: give FORM=NAME with one of the forms {', '.join(EXPORTS)}.")
        if not name or name in taken or name.startswith(".") or Path(name).name != name:
            raise CommandError(
                f"--export {word}: with --class this is a file in each student's folder. Give a name without "
                f"a folder, other than {', '.join(sorted(taken))}."
            )
        taken.add(name)
        names[form] = name
    return names


def grade_class(run: ClassRun) -> int:
    """Grade a class, write all results, report them, and return the exit code."""
    into = run.out / SORTED
    shutil.rmtree(into, ignore_errors=True)
    make_folder(into)
    try:
        students, left_out = _submissions(run, into)
        whole = _graded(run, [_adjusted(run, student) for student in students], left_out)
    finally:
        shutil.rmtree(into, ignore_errors=True)
    _report(whole, as_json=run.options.as_json)
    return ExitCode.DONE if any(entry.gradable for entry in whole.students) else ExitCode.UNUSABLE_INPUT


def _submissions(run: ClassRun, into: Path) -> tuple[Sequence[Student], Sequence[str]]:
    """The submissions, and the names of other files; those of a download are sorted into an empty folder."""
    wanted = {test.submitted.file for test in run.manifest.tests}
    students, left_out, troubles = sorted_download(run.folder, into, wanted)
    for trouble in troubles:
        output.say(output.harmless(trouble))
    if not students:
        students, left_out = submissions(run.folder)
    if not students:
        raise InputError(f"{run.folder} has no folders. {FOLDERS}")
    if left_out:
        output.say(f"Not submissions: {output.harmless(', '.join(left_out))}. {FOLDERS}")
    for correction in run.corrections:
        if not any(student.is_called(correction.student) for student in students):
            raise InputError(f"--overrides: no submission is called {correction.student!r}.")
    return students, left_out


def _adjusted(run: ClassRun, student: Student) -> Student:
    """A submission with its time and what staff give it."""
    submitted = last_written(student.folder) if run.options.takes_file_times else None
    if run.roster is not None:
        submitted = run.roster.submitted(student) or submitted
    if run.manifest.late is not None and submitted is None:
        output.say(f"{output.harmless(student.name)} has no time of submission; lateness costs nothing.")
    corrections = tuple(each for each in run.corrections if student.is_called(each.student))
    for one, other in combinations(corrections, 2):
        if one.test == other.test:
            raise InputError(
                f"--overrides: lines {one.line} and {other.line} both set the points of "
                f"{output.harmless(student.name)} in {one.test}, by name and by number. Keep one of them."
            )
    return replace(student, submitted=submitted, corrections=corrections)


def _graded(run: ClassRun, students: Sequence[Student], left_out: Sequence[str]) -> ClassGrade:
    # A changed list of exports changes what each student's folder gets.
    forms = [f"{form}={name}" for form, name in sorted(run.exports.items())]
    assignment = " ".join([assignment_key(run.manifest, run.options.references), *forms])
    keys = {student: submission_key(assignment, student) for student in students}
    before = {student: graded_before(run.place(student), key) for student, key in keys.items()}
    records = {student: record for student, record in before.items() if record is not None}
    if records:
        output.say(f"{len(records)} of {len(students)} submissions have not changed since they were graded.")
    if len(records) < len(keys):
        _grade_others(run, keys, records)
    return _save_class(run, {student: records[student] for student in students}, left_out)


def cells(whole: ClassGrade) -> Iterator[list[str]]:
    """For each submission its points, its name, the tests that are not graded, and its signals."""
    for entry in whole.students:
        points = number(entry.score) if entry.gradable else "-"
        signals = [f"{signal.test}: {signal.code}" for signal in entry.signals]
        for what, groups in (("same files", whole.shared_files), ("same noise", whole.shared_noise)):
            tests = [test for each in groups if entry.student in each.students for test in each.tests]
            signals += [f"{what}: {', '.join(tests)}"] if tests else []
        row = [f"{points}/{number(whole.max_score)}", entry.student, ", ".join(entry.ungraded)]
        yield [output.harmless(cell) for cell in (*row, "; ".join(signals))]


def _report(whole: ClassGrade, *, as_json: bool) -> None:
    """Print the result: as a table for people, and as cells with tabs for programs."""
    if output.on_terminal() and not as_json:
        output.show(output.table(HEADINGS, cells(whole), numbers=HEADINGS[:1], overflow="fold"))
    else:
        output.report(whole, map("\t".join, cells(whole)), as_json=as_json)


def _grade_others(run: ClassRun, keys: Mapping[Student, str], records: dict[Student, Graded]) -> None:
    """Grade the students without a record, save what each of them gets, and add their records."""
    left = [student for student in keys if student not in records]
    try:
        with progress_bar("grading") as bar:
            show = advancing(bar, len(left) * len(run.manifest.tests))
            results = class_grading.grade_class(
                run.manifest,
                left,
                references=run.options.references,
                jobs=run.options.processes,
                server=run.options.server,
                cache=run.options.cache,
                on_test=lambda student: show(student.name),
            )
            # Ctrl-C or a full disk ends all tests at once.
            with closing(results):
                for student, found in results:
                    _save(run, student, found, keys[student])
                    records[student] = replace(found, pictures={})
    finally:
        if len(records) < len(keys):
            output.say(f"{len(records)} of {len(keys)} submissions are graded. Run it again for the others.")


def _save(run: ClassRun, student: Student, found: Graded, key: str) -> None:
    """Write the result of a student; the key comes last, because it says that all is there."""
    place = run.place(student)
    make_folder(place)
    (place / KEY).unlink(missing_ok=True)
    for name, content in found.pictures.items():
        write_whole(place / name, content)
    for form, name in (("html-staff", STAFF_PAGE), *run.exports.items()):
        write_whole(place / name, EXPORTS[form](found.grade, place))
    write_whole(place / STUDENT_RESULT, f"{found.grade.model_dump_json(indent=2)}\n".encode())
    write_whole(place / PRINTS, packed(found.prints))
    write_whole(place / KEY, key.encode())


def _save_class(run: ClassRun, records: Mapping[Student, Graded], left_out: Sequence[str]) -> ClassGrade:
    by_student = {student: record.grade for student, record in records.items()}
    grades = {student.name: grade for student, grade in by_student.items()}
    prints = {student.name: record.prints for student, record in records.items()}
    files = shared_files(grades)
    noise, not_compared = shared_noise(run.manifest, run.options.references, prints, files)
    whole = of_class(
        run.manifest.title,
        by_student,
        files=files,
        noise=noise,
        not_compared=not_compared,
        left_out=left_out,
    )
    save(run.out / RESULT, f"{whole.model_dump_json(indent=2)}\n".encode())
    save(run.out / GRADEBOOK, for_class([*grades.values()], whole))
    save(run.out / PAGE, class_page(whole, grades, STAFF_PAGE), "open it in a browser")
    _save_roster(run, by_student)
    return whole


def _save_roster(run: ClassRun, grades: Mapping[Student, Grade]) -> None:
    """Write the roster with points, for the system that it is from."""
    if run.roster is None:
        return
    others = [student.name for student in grades if not run.roster.places(student)]
    if others:
        output.say(f"Not in the roster: {output.harmless(', '.join(others))}.")
    filled = run.roster.filled(grades, run.manifest.title)
    if filled is None:
        output.say(f"The roster has no column for points: neither 'Grade' nor {run.manifest.title!r}.")
    else:
        save(run.out / ROSTER, filled, "import it where the roster is from")
