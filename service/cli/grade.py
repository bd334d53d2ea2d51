"""``penumbra grade``: runs the tests of a manifest on a submission."""

from __future__ import annotations

import shutil
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError, ExitCode, InputError, UnusableSceneError
from service.cli.options import MOST_WORKERS, JsonOption, connect
from service.cli.progress import advancing, progress_bar
from service.cli.targets import check_target, make_folder, save, write_whole

if TYPE_CHECKING:
    from schemas.grading.grades import Grade
    from schemas.grading.manifests import Manifest
    from service.grading.adjustments import Correction
    from service.grading.grading import Graded

RESULT = "result.json"
YAML = (".yaml", ".yml")

COLORS = {"passed": "green", "partial": "yellow", "failed": "red"}
NO_POINTS = "-"
FILES = "files"
"""Stands for a time: that of the newest file of each submission."""

Table = TypeVar("Table")

ManifestArgument = Annotated[
    Path, typer.Argument(metavar="MANIFEST", help="The assignment, .yaml or .json.", show_default=False)
]
SubmissionOption = Annotated[Path, typer.Option(metavar="DIR", help="The folder with the submission.")]
ClassFolderOption = Annotated[
    Path | None,
    typer.Option(
        "--class",
        metavar="DIR",
        help="A folder with a folder for each submission, in place of --submission; needs -o, and grades "
        "only what has changed.",
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="DIR", help=f"Folder for {RESULT} and pictures of differences."),
]
ExportOption = Annotated[
    list[str] | None,
    typer.Option(metavar="FORM=PATH", help="Write the result in a platform's format too; repeatable."),
]
JobsOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=MOST_WORKERS,
        help="Tests at a time, each in its own process; by default one for each processor.",
    ),
]
ServerOption = Annotated[
    str | None,
    typer.Option(metavar="URL", help="A service that renders scenes in place of this machine."),
]
CacheOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Folder that keeps rendered references for the next submission."),
]
StudentOption = Annotated[
    str | None, typer.Option(help="Name or number of the submitter, for the result and --overrides.")
]
SubmittedAtOption = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help=f"Time of submission, ISO 8601; with --class {FILES}: that of the newest file of each.",
    ),
]
RosterOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.csv",
        help="With --class, the gradebook of Canvas, the grading worksheet of Moodle, or any table with "
        "student and submitted_at: gives times, and comes back with points.",
    ),
]
OverridesOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.csv", help="Points set by staff: a table with student, test, points and reason."
    ),
]
FailUnderOption = Annotated[
    float | None, typer.Option(min=0.0, help="Exit with 1 if there are fewer points.")
]


def grade(  # noqa: PLR0913 - one argument for each option
    *,
    manifest: ManifestArgument,
    submission: SubmissionOption = Path(),
    class_folder: ClassFolderOption = None,
    out: OutOption = None,
    export: ExportOption = None,
    jobs: JobsOption = None,
    server: ServerOption = None,
    cache: CacheOption = None,
    student: StudentOption = None,
    submitted_at: SubmittedAtOption = None,
    roster: RosterOption = None,
    overrides: OverridesOption = None,
    fail_under: FailUnderOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the tests of an assignment on a submission, and report the points and why they were lost."""
    given = GradeOptions(
        manifest, out, export or [], jobs, server, cache, student, submitted_at, overrides, as_json
    )
    if class_folder is None:
        if roster is not None:
            raise CommandError(
                "--roster is for --class. Give the time of one submission with --submitted-at."
            )
        raise typer.Exit(_grade_one(given, submission, fail_under))
    single = {
        "--submission": submission != Path(),
        "--student": student,
        "--fail-under": fail_under is not None,
        "--submitted-at": submitted_at not in {None, FILES},
    }
    if wrong := [name for name, is_given in single.items() if is_given]:
        raise CommandError(f"{', '.join(wrong)}: this is for one submission, and --class grades many.")
    raise typer.Exit(_grade_class(given, class_folder, roster))


@dataclass(frozen=True, slots=True)
class GradeOptions:
    """The options that one submission and a class share."""

    manifest: Path
    out: Path | None
    export: Sequence[str]
    jobs: int | None
    server: str | None
    cache: Path | None
    student: str | None
    submitted_at: str | None
    overrides: Path | None
    as_json: bool

    @property
    def references(self) -> Path:
        """The folder of the manifest."""
        return self.manifest.parent

    @property
    def takes_file_times(self) -> bool:
        """Whether submissions are as old as their newest file."""
        return self.submitted_at == FILES

    @property
    def processes(self) -> int:
        """Tests at a time."""
        from renderer.processors import usable_processors

        return self.jobs or usable_processors()

    def corrections(self, manifest: Manifest) -> tuple[Correction, ...]:
        """Points set by staff."""
        from service.grading.adjustments import read_corrections

        return read_table(self.overrides, partial(read_corrections, manifest=manifest)) or ()


def _grade_one(given: GradeOptions, submission: Path, fail_under: float | None) -> int:
    for folder in filter(None, (given.out, given.cache)):
        make_folder(folder)
    targets = _targets(given.export)
    if "classroom50" in targets:
        # Minutes of grading would be lost where the runner does not say whose submission it is.
        from service.grading.exports import classroom50

        classroom50.stamp(given.submitted_at)
    if not submission.is_dir():
        raise InputError(f"{submission} is not a folder. Give the folder with the submission.")
    _check_time(given.submitted_at)
    read = read_manifest_file(given.manifest)
    if read.late is not None and given.submitted_at is None:
        raise CommandError(f"{given.manifest} has a late policy. Give the time with --submitted-at.")
    corrections = given.corrections(read)
    if given.student is None and (given.overrides is not None or read.per_student is not None):
        needs = "--overrides" if given.overrides is not None else f"{given.manifest} has per_student, and"
        raise CommandError(f"{needs} needs the name of the submitter. Give it with --student.")
    _check_server(given.server)
    from service.grading.grading import grade as graded

    with progress_bar("grading") as bar:
        show = advancing(bar, len(read.tests))
        found = graded(
            read,
            references=given.references,
            submission=submission,
            jobs=given.processes,
            server=given.server,
            cache=given.cache,
            pictures=given.out is not None or bool(targets),
            student=given.student,
            submitted=given.submitted_at,
            corrections=[each for each in corrections if each.student == given.student],
            on_test=lambda test: show(test.name),
        )
    _save(found, given.out, targets)
    width = shutil.get_terminal_size().columns if output.on_terminal() else None
    output.report(found.grade, lines(found.grade, width), as_json=given.as_json)
    return _exit_code(found.grade, fail_under)


def _exit_code(found: Grade, fail_under: float | None) -> int:
    from service.grading.outcomes import reached

    if not found.gradable:
        return ExitCode.UNUSABLE_INPUT
    enough = fail_under is None or reached(found.score, fail_under, rising=True)
    return ExitCode.DONE if enough else ExitCode.BELOW_THRESHOLD


def _grade_class(given: GradeOptions, folder: Path, roster: Path | None) -> int:
    from service.cli.grade_class import ClassRun, check_folders, file_names, grade_class
    from service.grading.classes.rosters import Roster

    place = check_folders(folder, given.out)
    exports = file_names(given.export)
    for made in filter(None, (place, given.cache)):
        make_folder(made)
    read = read_manifest_file(given.manifest)
    if read.late is not None and roster is None and given.submitted_at is None:
        raise CommandError(
            f"{given.manifest} has a late policy. Give times by --roster FILE.csv or --submitted-at {FILES}."
        )
    _check_server(given.server)
    table, corrections = read_table(roster, Roster.read), given.corrections(read)
    return grade_class(ClassRun(given, read, folder, place, exports, table, corrections))


def read_table(path: Path | None, read: Callable[[bytes], Table]) -> Table | None:
    """Read a file, if one was given."""
    from service.grading.errors import AdjustmentError

    try:
        return None if path is None else read(scene_files.read_bytes(str(path)))
    except AdjustmentError as error:
        raise InputError(f"{path}: {error}") from error


def _check_server(address: str | None) -> None:
    """Without the service every test would fail."""
    if address is not None:
        with connect(address) as client:
            client.version()


def read_manifest_file(path: Path) -> Manifest:
    """The manifest in a file; InputError if it is unusable, with all that is wrong in it."""
    from schemas.errors import SceneError
    from schemas.grading.manifest_reading import read_manifest

    if path.suffix.lower() not in (*YAML, ".json"):
        raise CommandError(f"{path} must end in .yaml, .yml or .json. The ending decides how it is read.")
    text = scene_files.read_bytes(str(path))
    try:
        return read_manifest(text, yaml=path.suffix.lower() in YAML)
    except SceneError as error:
        raise UnusableSceneError(str(path), text, error.errors, error.more) from error


def _targets(words: Sequence[str]) -> dict[str, Path]:
    """The form and the path of each export."""
    if not words:
        return {}
    from service.grading.exports import EXPORTS

    targets: dict[str, Path] = {}
    for word in words:
        form, _, path = word.partition("=")
        if form not in EXPORTS or not path:
            raise CommandError(f"--export {word}: give FORM=PATH with one of the forms {', '.join(EXPORTS)}.")
        if form in targets or Path(path).resolve() in {other.resolve() for other in targets.values()}:
            raise CommandError(f"--export {word}: give each form once, and each its own file.")
        targets[form] = check_target(Path(path), (Path(path).suffix.lower(),))
    return targets


def _check_time(text: str | None) -> None:
    from datetime import datetime

    try:
        if text is not None:
            datetime.fromisoformat(text)
    except ValueError as error:
        raise CommandError(f"--submitted-at {text}: give a time such as 2026-11-21T20:15:00Z.") from error


def _save(found: Graded, out: Path | None, targets: Mapping[str, Path]) -> None:
    from service.grading.exports import EXPORTS

    with tempfile.TemporaryDirectory(prefix="penumbra-grade-") as temporary:
        folder = out or Path(temporary)
        for name, content in found.pictures.items():
            write_whole(folder / name, content)
        if out is not None:
            save(out / RESULT, f"{found.grade.model_dump_json(indent=2)}\n".encode())
        for form, path in targets.items():
            save(path, EXPORTS[form](found.grade, folder))


def lines(found: Grade, width: int | None) -> Iterator[str]:
    """A grade as lines: wrapped to a width for people, without one cells with tabs for programs."""
    from service.grading.exports.rows import WORDS, for_staff
    from service.grading.exports.texts import line, number

    for row in for_staff(found):
        points = f"{NO_POINTS if row.open else number(row.points)}/{number(row.max_points)}"
        word = "late" if row.is_deduction else row.status
        message = "" if row.result == WORDS["passed"] else row.message
        if width is None:
            yield "\t".join([word, points, row.name, row.id, line(message)])
            continue
        yield f"{output.emphasis(f'{word:<13}', COLORS.get(word))}{points:>9}  {row.name}"
        yield from textwrap.wrap(message, width, initial_indent=" " * 4, subsequent_indent=" " * 4)
    if found.own_scenes:
        yield f"The references are the scenes of {output.harmless(found.student or '')} alone."
    for signal in found.signals:
        yield f"for staff: {signal.test}: {output.harmless(signal.message)}"
    yield f"{output.emphasis(f'{number(found.score)} of {number(found.max_score)} points')}, {found.verdict}"
