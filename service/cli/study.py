"""``penumbra study``: what accuracy costs in time, tried out on one scene and written up in a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import CommandError, RenderFailedError
from service.cli.progress import progress_bar
from service.cli.targets import write_whole

if TYPE_CHECKING:
    from accuracy.study.running import Forecast, Study
    from accuracy.study.settings import Scale
    from renderer import LoadedScene

OutOption = Annotated[
    Path, typer.Option("--out", help="A folder for the report, and for the journal that lets a study go on.")
]
BudgetOption = Annotated[
    float | None,
    typer.Option(
        "--budget",
        min=0.1,
        help="Seconds that it may take; the most informative settings come first.",
        show_default=False,
    ),
]
SideOption = Annotated[
    int | None,
    typer.Option(
        "--side",
        min=16,
        help="Pixels along the longer side of the pictures that are tried, at most those of the scene. "
        "By default 256.",
        show_default=False,
    ),
]
QuickOption = Annotated[bool, typer.Option("--quick", help="Few settings on a picture of 48 pixels.")]


def study(
    *,
    scene: scene_files.SceneArgument,
    out: OutOption,
    budget: BudgetOption = None,
    side: SideOption = None,
    quick: QuickOption = False,
    as_json: output.JsonOption = False,
) -> None:
    """Render a scene with many settings, and report what error each has and what it costs.

    A study that was stopped goes on with the same command; nothing is rendered twice.
    """
    _check_plots()
    file = scene_files.load(scene)
    file.plan()
    _make_folder(out)
    course = _begun(file.scene, out, _scale(side, quick=quick), budget)
    forecast = course.forecast()
    output.say(_announced(forecast))
    document = _run(course)
    results = _written(course, document, out)
    if as_json:
        output.document(results)
        return
    for entry in results["answers"]:
        output.result(f"{output.emphasis(entry['question'])} {output.harmless(entry['answer'])}")
    output.result(results["about"])
    output.say(f"The report is {out / 'report.html'}")


def _scale(side: int | None, *, quick: bool) -> Scale:
    from accuracy.study.settings import FULL, QUICK

    scale = QUICK if quick else FULL
    return scale if side is None else replace(scale, side=side)


def _check_plots() -> None:
    from accuracy.plotting import require_matplotlib
    from renderer.errors import MissingExtraError

    try:
        require_matplotlib()
    except MissingExtraError as error:
        raise CommandError(str(error)) from error


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"{out} cannot be made a folder: {error.strerror or error}.") from error


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
    from renderer import RenderError

    share = 0.0
    with progress_bar("study") as bar:

        def show(forecast: Forecast) -> None:
            nonlocal share
            # What is expected changes with what is measured; the bar does not go back.
            share = max(share, forecast.share)
            bar.show(share, f"{seconds(forecast.seconds)} left, {forecast.now}")

        try:
            document = course.run(show)
        except RenderError as error:
            raise RenderFailedError(str(error)) from error
        except OSError as error:
            raise CommandError(f"The journal cannot be written: {error.strerror or error}.") from error
        bar.show(1.0, "done")
    return document


def _written(course: Study, document: Mapping[str, Any], out: Path) -> dict[str, Any]:
    from accuracy.study import report

    results = report.answered(document)
    for name, content in report.files(course, results).items():
        path = out / name
        _make_folder(path.parent)
        write_whole(path, content)
    return results
