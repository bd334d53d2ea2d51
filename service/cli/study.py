"""``penumbra study``: renders one scene with many settings and reports error against time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError
from service.cli.options import JsonOption, SceneArgument
from service.cli.progress import progress_bar
from service.cli.targets import make_folder, write_whole

if TYPE_CHECKING:
    from accuracy.study.running import Forecast, Study
    from accuracy.study.settings import Scale
    from renderer import LoadedScene


def study(
    *,
    scene: SceneArgument,
    out: Annotated[
        Path,
        typer.Option(help="A folder for the report and the journal, from which the same command resumes."),
    ],
    budget: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            max=31_536_000,  # a year
            help="Time limit in seconds; the most informative settings come first.",
            show_default=False,
        ),
    ] = None,
    side: Annotated[
        int | None,
        typer.Option(
            min=16,
            help="Longer side of the test pictures in pixels, at most that of the scene. By default 256.",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few settings on a picture of 48 pixels.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure the error and the cost of a scene with many settings.

    The same command resumes a study that was stopped; nothing is rendered twice.
    """
    from accuracy.plotting import require_matplotlib

    require_matplotlib()
    file = scene_files.load(scene)
    file.plan()
    make_folder(out)
    course = _begun(file.scene, out, _scale(side, quick=quick), budget)
    forecast = course.forecast()
    output.say(_announced(forecast))
    results = _written(course, _run(course), out)
    output.report(results, _lines(results), as_json=as_json)
    if not as_json:
        output.say(f"The report is {out / 'report.html'}")


def _lines(results: Mapping[str, Any]) -> Iterator[str]:
    for entry in results["answers"]:
        yield f"{output.emphasis(entry['question'])} {output.harmless(entry['answer'])}"
    yield results["about"]


def _scale(side: int | None, *, quick: bool) -> Scale:
    from accuracy.study.settings import FULL, QUICK

    scale = QUICK if quick else FULL
    return scale if side is None else replace(scale, side=side)


def _begun(scene: LoadedScene, out: Path, scale: Scale, budget: float | None) -> Study:
    from accuracy.study.running import Study

    try:
        return Study(scene, out, scale, budget)
    except OSError as error:
        raise CommandError(f"{out} cannot be used: {error.strerror or error}.") from error


def _announced(forecast: Forecast) -> str:
    from accuracy.study.words import seconds

    known = f", {forecast.done} of them done before" if forecast.done else ""
    return f"{forecast.runs} pictures to render{known}: about {seconds(forecast.seconds)}."


def _run(course: Study) -> dict[str, Any]:
    from accuracy.study.words import seconds

    share = 0.0
    with progress_bar("study") as bar:

        def show(forecast: Forecast) -> None:
            nonlocal share
            # The forecast changes with measurements, but the bar never goes back.
            share = max(share, forecast.share)
            bar.show(share, f"{seconds(forecast.seconds)} left, {forecast.now}")

        try:
            document = course.run(show)
        except OSError as error:
            raise CommandError(f"The journal cannot be written: {error.strerror or error}.") from error
        bar.show(1.0, "done")
    return document


def _written(course: Study, document: Mapping[str, Any], out: Path) -> dict[str, Any]:
    from accuracy.study import report

    results = report.answered(document)
    for name, content in report.files(course, results).items():
        path = out / name
        make_folder(path.parent)
        write_whole(path, content)
    return results
