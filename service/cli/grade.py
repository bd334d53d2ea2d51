"""``penumbra grade``: a submission is held to the tests of a manifest."""

from __future__ import annotations

import os
import shutil
import tempfile
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output, scene_files
from service.cli.connection import connect
from service.cli.errors import CommandError, ExitCode, InputError, UnusableSceneError
from service.cli.progress import progress_bar
from service.cli.render_options import MOST_WORKERS
from service.cli.targets import check_target, write_whole

if TYPE_CHECKING:
    from schemas.grades import Grade, TestGrade
    from schemas.manifests import Manifest
    from service.grading.grading import Graded

RESULT = "result.json"
YAML = (".yaml", ".yml")

COLORS = {"passed": "green", "partial": "yellow", "failed": "red"}
NO_POINTS = "-"

ManifestArgument = Annotated[
    Path, typer.Argument(metavar="MANIFEST", help="The assignment, .yaml or .json.", show_default=False)
]
SubmissionOption = Annotated[
    Path, typer.Option("--submission", metavar="DIR", help="The folder with what was handed in.")
]
OutOption = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="DIR", help=f"Where {RESULT} and pictures of differences go."),
]
ExportOption = Annotated[
    list[str] | None,
    typer.Option("--export", metavar="FORM=PATH", help="Write the result in a platform's form; repeatable."),
]
JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs", min=1, max=MOST_WORKERS, help="Tests at a time; by default one for each processor."
    ),
]
ServerOption = Annotated[
    str | None,
    typer.Option("--server", metavar="URL", help="The service that renders, in place of this machine."),
]
CacheOption = Annotated[
    Path | None,
    typer.Option("--cache", metavar="DIR", help="Where rendered references stay for the next time."),
]
StudentOption = Annotated[
    str | None, typer.Option("--student", help="Whose submission it is, for the result.")
]
MomentOption = Annotated[
    str | None, typer.Option("--submitted-at", metavar="TIME", help="Its moment, ISO 8601, for the result.")
]
FailOption = Annotated[
    float | None, typer.Option("--fail-under", min=0.0, help="Leave with 1 if there are fewer points.")
]


def grade(  # noqa: PLR0913 - one argument for each option
    *,
    manifest: ManifestArgument,
    submission: SubmissionOption = Path(),
    out: OutOption = None,
    export: ExportOption = None,
    jobs: JobsOption = None,
    server: ServerOption = None,
    cache: CacheOption = None,
    student: StudentOption = None,
    submitted_at: MomentOption = None,
    fail_under: FailOption = None,
    as_json: output.JsonOption = False,
) -> None:
    """Grade a submission: points, why they were lost, and the result in the forms of platforms."""
    for folder in filter(None, (out, cache)):
        _make(folder)
    targets = _targets(export or [])
    if not submission.is_dir():
        raise InputError(f"{submission} is not a folder. Name the folder with what was handed in.")
    _check_moment(submitted_at)
    read = _read(manifest)
    if server is not None:
        # Without a service every test would fail, and say so.
        with connect(server) as client:
            client.version()
    from service.grading.grading import grade as graded

    with progress_bar("grading") as bar:
        done: list[str] = []

        def show(test: TestGrade) -> None:
            done.append(test.id)
            bar.show(len(done) / len(read.tests), test.name)

        found = graded(
            read,
            references=manifest.parent,
            submission=submission,
            jobs=jobs or len(os.sched_getaffinity(0)),
            server=server,
            cache=cache,
            pictures=out is not None or bool(targets),
            student=student,
            submitted=submitted_at,
            on_test=show,
        )
    _save(found, out, targets)
    _tell(found.grade, as_json=as_json)
    if not found.grade.gradable:
        raise typer.Exit(ExitCode.UNUSABLE_INPUT)
    from service.grading.scales import reached

    if fail_under is not None and not reached(found.grade.score, fail_under, rising=True):
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


def _read(path: Path) -> Manifest:
    from schemas.errors import SceneError
    from schemas.manifest_reading import read_manifest

    if path.suffix.lower() not in (*YAML, ".json"):
        raise CommandError(f"{path} must end in .yaml, .yml or .json. The ending says how it is read.")
    text = scene_files.read_bytes(str(path))
    try:
        return read_manifest(text, yaml=path.suffix.lower() in YAML)
    except SceneError as error:
        raise UnusableSceneError(str(path), text, error.errors, error.more) from error


def _targets(words: Sequence[str]) -> dict[str, Path]:
    """Where the result goes in which form."""
    if not words:
        return {}
    from service.grading.exports import EXPORTS

    targets = {}
    for word in words:
        form, _, path = word.partition("=")
        if form not in EXPORTS or not path:
            raise CommandError(f"--export {word}: give FORM=PATH with one of the forms {', '.join(EXPORTS)}.")
        targets[form] = check_target(Path(path), (Path(path).suffix.lower(),))
    return targets


def _check_moment(moment: str | None) -> None:
    from datetime import datetime

    try:
        if moment is not None:
            datetime.fromisoformat(moment)
    except ValueError as error:
        raise CommandError(
            f"--submitted-at {moment}: give a time such as 2026-11-21T20:15:00+00:00."
        ) from error


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"{folder} cannot be made ({error.strerror}). Name another folder.") from error


def _save(found: Graded, out: Path | None, targets: Mapping[str, Path]) -> None:
    if out is None and not targets:
        return
    with _pictures(found.pictures, out) as folder:
        if out is not None:
            text = found.grade.model_dump_json(indent=2) + "\n"
            _write(out / RESULT, text.encode())
        if targets:
            from service.grading.exports import EXPORTS

            for form, path in targets.items():
                _write(path, EXPORTS[form](found.grade, folder))


def _write(path: Path, content: bytes) -> None:
    write_whole(path, content)
    output.say(f"{path}: written")


@contextmanager
def _pictures(pictures: Mapping[str, bytes], out: Path | None) -> Iterator[Path]:
    """A folder with all pictures: that of the user, or one that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="penumbra-grade-") as passing:
        folder = out or Path(passing)
        for name, content in pictures.items():
            write_whole(folder / name, content)
        yield folder


def _tell(found: Grade, *, as_json: bool) -> None:
    if as_json:
        output.document(found.model_dump(mode="json"))
        return
    width = shutil.get_terminal_size().columns if output.on_terminal() else None
    for line in lines(found, width):
        output.result(line)


def lines(found: Grade, width: int | None) -> Iterator[str]:
    """A grade in words; with a width for people, without it tabs between cells for programs."""
    for test in found.tests:
        points = NO_POINTS if test.id in found.ungraded else f"{test.points:g}"
        cells = [test.status, f"{points}/{test.max_points:g}", output.harmless(test.name)]
        message = output.harmless(test.message) if test.status != "passed" else ""
        if width is None:
            yield "\t".join([*cells, test.id, message])
            continue
        status = output.emphasis(f"{cells[0]:<13}", COLORS.get(test.status))
        yield f"{status}{cells[1]:>9}  {cells[2]}" + ("  (bonus)" if test.bonus else "")
        yield from textwrap.wrap(message, width, initial_indent=" " * 4, subsequent_indent=" " * 4)
    for signal in found.signals:
        yield f"for staff: {signal.test}: {output.harmless(signal.message)}"
    yield f"{output.emphasis(f'{found.score:g} of {found.max_score:g} points')}, {found.verdict}"
