"""``penumbra grade``: runs the tests of a manifest on a submission."""

from __future__ import annotations

import shutil
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError, ExitCode, InputError, UnusableSceneError
from service.cli.options import MOST_WORKERS, JsonOption, connect
from service.cli.progress import progress_bar
from service.cli.targets import check_target, make_folder, save, write_whole

if TYPE_CHECKING:
    from schemas.grading.grades import Grade, TestGrade
    from schemas.grading.manifests import Manifest
    from service.grading.grading import Graded

RESULT = "result.json"
YAML = (".yaml", ".yml")

COLORS = {"passed": "green", "partial": "yellow", "failed": "red"}
NO_POINTS = "-"


def grade(  # noqa: PLR0913 - one argument for each option
    *,
    manifest: Annotated[
        Path, typer.Argument(metavar="MANIFEST", help="The assignment, .yaml or .json.", show_default=False)
    ],
    submission: Annotated[Path, typer.Option(metavar="DIR", help="The folder with the submission.")] = Path(),
    class_folder: Annotated[
        Path | None,
        typer.Option(
            "--class",
            metavar="DIR",
            help="A folder with a folder for each submission, in place of --submission; needs -o, and grades "
            "only what has changed.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help=f"Folder for {RESULT} and pictures of differences."),
    ] = None,
    export: Annotated[
        list[str] | None,
        typer.Option(metavar="FORM=PATH", help="Write the result in a platform's format too; repeatable."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MOST_WORKERS,
            help="Tests at a time, each in its own process; by default one for each processor.",
        ),
    ] = None,
    server: Annotated[
        str | None,
        typer.Option(metavar="URL", help="A service that renders scenes in place of this machine."),
    ] = None,
    cache: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder that keeps rendered references for the next submission."),
    ] = None,
    student: Annotated[str | None, typer.Option(help="Name of the submitter, for the result.")] = None,
    submitted_at: Annotated[
        str | None, typer.Option(metavar="TIME", help="Time of submission, ISO 8601, for the result.")
    ] = None,
    fail_under: Annotated[
        float | None, typer.Option(min=0.0, help="Exit with 1 if there are fewer points.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run the tests of an assignment on a submission, and report the points and why they were lost."""
    if class_folder is not None:
        single = {"--submission": submission != Path(), "--student": student, "--submitted-at": submitted_at}
        _refuse_with_class(single | {"--fail-under": fail_under is not None})
        code = _grade_class(manifest, class_folder, out, export or [], jobs, server, cache, as_json=as_json)
        raise typer.Exit(code)
    for folder in filter(None, (out, cache)):
        make_folder(folder)
    targets = _targets(export or [])
    if "classroom50" in targets:
        # Minutes of grading would be lost where the runner does not say whose submission it is.
        from service.grading.exports import classroom50

        classroom50.stamp(submitted_at)
    if not submission.is_dir():
        raise InputError(f"{submission} is not a folder. Give the folder with the submission.")
    _check_time(submitted_at)
    read = _read(manifest)
    _check_server(server)
    from renderer.processors import usable_processors
    from service.grading.grading import grade as graded

    with _progress(read) as show:
        found = graded(
            read,
            references=manifest.parent,
            submission=submission,
            jobs=jobs or usable_processors(),
            server=server,
            cache=cache,
            pictures=out is not None or bool(targets),
            student=student,
            submitted=submitted_at,
            on_test=show,
        )
    _save(found, out, targets)
    width = shutil.get_terminal_size().columns if output.on_terminal() else None
    output.report(found.grade, lines(found.grade, width), as_json=as_json)
    if not found.grade.gradable:
        raise typer.Exit(ExitCode.UNUSABLE_INPUT)
    from service.grading.scales import reached

    if fail_under is not None and not reached(found.grade.score, fail_under, rising=True):
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


@contextmanager
def _progress(manifest: Manifest) -> Iterator[Callable[[TestGrade], None]]:
    """A progress bar, moved by each test that is graded."""
    done: list[str] = []
    with progress_bar("grading") as bar:

        def show(test: TestGrade) -> None:
            done.append(test.id)
            bar.show(len(done) / len(manifest.tests), test.name)

        yield show


def _refuse_with_class(given: Mapping[str, object]) -> None:
    wrong = [name for name, value in given.items() if value]
    if wrong:
        raise CommandError(f"{', '.join(wrong)}: this is for one submission, and --class grades many.")


def _grade_class(
    manifest: Path,
    folder: Path,
    out: Path | None,
    export: Sequence[str],
    jobs: int | None,
    server: str | None,
    cache: Path | None,
    *,
    as_json: bool,
) -> int:
    from renderer.processors import usable_processors
    from service.cli.grade_class import ClassRun, check_folders, file_names, grade_class

    place = check_folders(folder, out)
    exports = file_names(export)
    for made in filter(None, (place, cache)):
        make_folder(made)
    read = _read(manifest)
    _check_server(server)
    run = ClassRun(
        manifest=read,
        references=manifest.parent,
        folder=folder,
        out=place,
        exports=exports,
        jobs=jobs or usable_processors(),
        server=server,
        cache=cache,
    )
    return grade_class(run, as_json=as_json)


def _check_server(address: str | None) -> None:
    """Without the service every test would fail."""
    if address is not None:
        with connect(address) as client:
            client.version()


def _read(path: Path) -> Manifest:
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
    if out is None and not targets:
        return
    with _pictures(found.pictures, out) as folder:
        if out is not None:
            text = found.grade.model_dump_json(indent=2) + "\n"
            save(out / RESULT, text.encode())
        if targets:
            from service.grading.exports import EXPORTS

            for form, path in targets.items():
                save(path, EXPORTS[form](found.grade, folder))


@contextmanager
def _pictures(pictures: Mapping[str, bytes], out: Path | None) -> Iterator[Path]:
    """A folder with all pictures: that of the user, or a temporary one."""
    with tempfile.TemporaryDirectory(prefix="penumbra-grade-") as temporary:
        folder = out or Path(temporary)
        for name, content in pictures.items():
            write_whole(folder / name, content)
        yield folder


def lines(found: Grade, width: int | None) -> Iterator[str]:
    """A grade as lines: wrapped to a width for people, without one cells with tabs for programs."""
    from service.grading.exports.texts import number

    for test in found.tests:
        points = NO_POINTS if test.id in found.ungraded else number(test.points)
        cells = [test.status, f"{points}/{number(test.max_points)}", output.harmless(test.name)]
        message = output.harmless(test.message) if test.status != "passed" else ""
        if width is None:
            yield "\t".join([*cells, test.id, message])
            continue
        status = output.emphasis(f"{cells[0]:<13}", COLORS.get(test.status))
        yield f"{status}{cells[1]:>9}  {cells[2]}" + ("  (bonus)" if test.bonus else "")
        yield from textwrap.wrap(message, width, initial_indent=" " * 4, subsequent_indent=" " * 4)
    for signal in found.signals:
        yield f"for staff: {signal.test}: {output.harmless(signal.message)}"
    yield f"{output.emphasis(f'{number(found.score)} of {number(found.max_score)} points')}, {found.verdict}"
