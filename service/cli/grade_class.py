"""``penumbra grade --class``: grades the submissions of a class, and writes a gradebook and a page."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.errors import CommandError, ExitCode, InputError
from service.cli.progress import Bar, progress_bar, remaining
from service.cli.targets import make_folder, save, write_whole

if TYPE_CHECKING:
    from schemas.grading.classes import ClassGrade
    from schemas.grading.grades import Grade
    from schemas.grading.manifests import Manifest
    from service.grading.class_records import Student
    from service.grading.grading import Graded

GRADEBOOK, PAGE, RESULT = "gradebook.csv", "index.html", "class.json"
STAFF_PAGE = "staff.html"


@dataclass(frozen=True, slots=True)
class ClassRun:
    """What to grade, and where results go.

    Attributes
    ----------
    manifest : Manifest
    references : Path
        The folder of the manifest.
    folder : Path
        The folder of the class, with a folder for each submission.
    out : Path
    exports : mapping of str to str
        By form, the name of the file in each student's folder.
    jobs : int
    server : str or None
    cache : Path or None
    """

    manifest: Manifest
    references: Path
    folder: Path
    out: Path
    exports: Mapping[str, str]
    jobs: int
    server: str | None
    cache: Path | None

    def place(self, student: Student) -> Path:
        """The folder for the result of a student."""
        from service.grading.class_results import STUDENTS

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
    from service.grading.class_records import KEY
    from service.grading.class_records import RESULT as STUDENT_RESULT
    from service.grading.exports import EXPORTS

    taken = {KEY, STUDENT_RESULT, STAFF_PAGE}
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


def grade_class(run: ClassRun, *, as_json: bool) -> int:
    """Grade a class, write all results, report them, and return the exit code."""
    from service.grading.class_records import assignment_key, graded_before, students_of, submission_key

    students = students_of(run.folder)
    if not students:
        raise InputError(f"{run.folder} has no folders. Put each submission into a folder of its own there.")
    assignment = _with_forms(assignment_key(run.manifest, run.references), run.exports)
    keys = {student: submission_key(assignment, student) for student in students}
    known = {student: graded_before(run.place(student), key) for student, key in keys.items()}
    grades = {student: grade for student, grade in known.items() if grade is not None}
    if grades:
        output.say(f"{len(grades)} of {len(students)} submissions have not changed since they were graded.")
    left = [student for student in students if student not in grades]
    # Ctrl-C or a full disk ends all tests at once.
    with progress_bar("grading") as bar, closing(_graded(run, left, bar)) as results:
        for student, found in results:
            _save(run, student, found, keys[student])
            grades[student] = found.grade
    whole = _save_class(run, [(student, grades[student]) for student in students])
    output.report(whole, lines(whole), as_json=as_json)
    return ExitCode.DONE if any(entry.gradable for entry in whole.students) else ExitCode.UNUSABLE_INPUT


def lines(whole: ClassGrade) -> Iterator[str]:
    """A line for each submission with its points, the tests that are not graded, and its signals."""
    from service.grading.exports.texts import number

    for entry in whole.students:
        points = number(entry.score) if entry.gradable else "-"
        signals = ", ".join(f"{signal.test}: {signal.code}" for signal in entry.signals)
        cells = [f"{points}/{number(whole.max_score)}", entry.student, ", ".join(entry.ungraded), signals]
        yield "\t".join(map(output.harmless, cells))
    for shared in whole.shared_files:
        names = output.harmless(", ".join(shared.students))
        yield f"same files\t{names}\t{', '.join(shared.tests)}"


def _with_forms(key: str, exports: Mapping[str, str]) -> str:
    """The key of an assignment together with the files that each student's folder gets."""
    return " ".join([key, *(f"{form}={name}" for form, name in sorted(exports.items()))])


def _graded(
    run: ClassRun, students: Sequence[Student], bar: Bar
) -> Generator[tuple[Student, Graded], None, None]:
    from service.grading.class_grading import grade_class as graded

    return graded(
        run.manifest,
        students,
        references=run.references,
        jobs=run.jobs,
        server=run.server,
        cache=run.cache,
        on_test=_shown(bar, len(students) * len(run.manifest.tests)),
    )


def _shown(bar: Bar, total: int) -> Callable[[Student], None]:
    """Advance the bar by a test, and estimate the remaining time from those that are done."""
    begun, done = time.monotonic(), 0

    def show(student: Student) -> None:
        nonlocal done
        done += 1
        left = (time.monotonic() - begun) * (total - done) / done
        bar.show(done / total, output.harmless(student.name) + remaining(left))

    return show


def _save(run: ClassRun, student: Student, found: Graded, key: str) -> None:
    """Write the result of a student; the key comes last, because it says that all is there."""
    from service.grading.class_records import KEY
    from service.grading.class_records import RESULT as STUDENT_RESULT
    from service.grading.exports import EXPORTS

    place = run.place(student)
    make_folder(place)
    (place / KEY).unlink(missing_ok=True)
    for name, content in found.pictures.items():
        write_whole(place / name, content)
    for form, name in {"html-staff": STAFF_PAGE}.items() | run.exports.items():
        write_whole(place / name, EXPORTS[form](found.grade, place))
    write_whole(place / STUDENT_RESULT, f"{found.grade.model_dump_json(indent=2)}\n".encode())
    write_whole(place / KEY, key.encode())


def _save_class(run: ClassRun, graded: Sequence[tuple[Student, Grade]]) -> ClassGrade:
    from service.grading.class_results import of_class
    from service.grading.exports.class_page import class_page
    from service.grading.exports.gradebook import for_class

    whole = of_class(run.manifest.title, graded[0][1].max_score, graded)
    grades = {student.name: grade for student, grade in graded}
    save(run.out / RESULT, f"{whole.model_dump_json(indent=2)}\n".encode())
    save(run.out / GRADEBOOK, for_class([*grades.values()], whole.shared_files))
    save(run.out / PAGE, class_page(whole, grades, STAFF_PAGE), "open it in a browser")
    return whole
