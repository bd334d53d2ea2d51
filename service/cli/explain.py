"""``penumbra validate`` and ``explain``: what is wrong with a scene, and what it asks of the renderer."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import ExitCode, InputError, UnusableSceneError
from service.cli.render_options import QualityOptions, spread_quality
from service.cli.targets import LayersOption, parsed_layers

if TYPE_CHECKING:
    from renderer import LoadedScene, RenderPlan
    from schemas.plans import PlanDocument
    from schemas.problems import Problem

ScenesArgument = Annotated[
    list[str],
    typer.Argument(metavar="SCENE...", help="Scene files; - reads one from stdin.", show_default=False),
]


@dataclass(frozen=True, slots=True)
class Finding:
    """What there is to say about one file."""

    name: str
    text: bytes = b""
    errors: Sequence[Problem] = ()
    warnings: Sequence[Problem] = ()
    more: int = 0

    @property
    def valid(self) -> bool:
        """Whether the file can be rendered."""
        return not self.errors


def validate(scenes: ScenesArgument, as_json: output.JsonOption = False) -> None:
    """Show every error and warning of scene files, each with its pointer, line and column."""
    findings = [_examine(name) for name in scenes]
    if as_json:
        files = [_as_document(finding) for finding in findings]
        output.document({"valid": all(finding.valid for finding in findings), "files": files})
    else:
        for finding in findings:
            _show_finding(finding)
    if not all(finding.valid for finding in findings):
        raise typer.Exit(ExitCode.UNUSABLE_INPUT)


def _examine(name: str) -> Finding:
    from schemas.problems import Problem

    try:
        file = scene_files.read(name)
        file.plan()
    except UnusableSceneError as error:
        return Finding(name, error.text, error.problems, more=error.more)
    except InputError as error:
        return Finding(name, errors=[Problem(pointer="", detail=str(error), code="not_readable")])
    return Finding(name, file.text, warnings=file.scene.warnings)


def _show_finding(finding: Finding) -> None:
    output.result(f"{output.emphasis(output.harmless(finding.name))}: {_summary(finding)}")
    for line in output.excerpts(finding.text, finding.errors, finding.more):
        output.result(line)
    for line in output.excerpts(finding.text, finding.warnings, kind="warning"):
        output.result(line)


def _summary(finding: Finding) -> str:
    counts = [(len(finding.errors) + finding.more, "error"), (len(finding.warnings), "warning")]
    said = [f"{count} {word}{'s' if count > 1 else ''}" for count, word in counts if count]
    return ", ".join(said) or output.emphasis("ok", "green")


def _as_document(finding: Finding) -> dict[str, Any]:
    return {
        "file": finding.name,
        "valid": finding.valid,
        "errors": [problem.model_dump(exclude_none=True) for problem in finding.errors],
        "more": finding.more,
        "warnings": [problem.model_dump(exclude_none=True) for problem in finding.warnings],
    }


def measured_costs(scene: LoadedScene) -> dict[str, Any]:
    """CPU seconds of a small picture, and what each effect adds to it, as one document."""
    from dataclasses import asdict

    from accuracy.variations import marginal_costs

    seconds, rows = marginal_costs(scene)
    return {"cpu_seconds": seconds, "effects": [asdict(row) for row in rows]}


def _show_measured(measured: dict[str, Any]) -> None:
    """Print the costs: a table on a terminal, a line an effect elsewhere."""
    if not output.on_terminal():
        for row in measured["effects"]:
            values = (
                row["effect"],
                f"{row['seconds']:.4f}",
                f"{row['difference'] * 255:.3f}",
                *row["pointers"],
            )
            output.result("measured\t" + "\t".join(output.harmless(str(value)) for value in values))
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table("Effect", "CPU seconds", "Share", "Difference x 255", "Asked for by", box=box.SIMPLE_HEAD)
    for row in measured["effects"]:
        pointers = "\n".join(output.harmless(pointer) for pointer in row["pointers"][:3])
        numbers = (f"{row['seconds']:.3f}", f"{row['share']:.0%}", f"{row['difference'] * 255:.2f}")
        table.add_row(row["effect"], *numbers, pointers)
    console = Console(markup=False, highlight=False)
    seconds = f"{measured['cpu_seconds']:.3f} CPU seconds"
    console.print(f"Measured on a small picture of {seconds}, each effect left out once:")
    console.print(table)


MOST_POINTERS = 3

CostOption = Annotated[
    bool,
    typer.Option(
        "--cost",
        help="Also measure what each effect costs: a small picture is rendered with and without it.",
    ),
]


@spread_quality
def explain(
    *,
    scene: scene_files.SceneArgument,
    quality: QualityOptions,
    layers: LayersOption = None,
    cost: CostOption = False,
    as_json: output.JsonOption = False,
) -> None:
    """Show the plan of a scene: its stages, who asked for each, what is left out, the predicted cost."""
    file = scene_files.load(scene)
    requested = quality.requested(file.scene.document.model_dump())
    plan = _priced(file.plan(requested, parsed_layers(layers)))
    measured = measured_costs(file.scene) if cost else None
    if as_json:
        output.document(plan.model_dump(mode="json") | ({"measured": measured} if measured else {}))
    elif output.on_terminal():
        _show_tables(plan)
    else:
        for line in _plain(plan):
            output.result(line)
    if measured and not as_json:
        _show_measured(measured)


def _priced(plan: RenderPlan) -> PlanDocument:
    """The plan, with the price of a picture that all processors of this machine render."""
    from accuracy.quotes.prices import price

    return plan.describe().model_copy(update={"cost": price(plan, len(os.sched_getaffinity(0)))})


def _plain(plan: PlanDocument) -> Iterable[str]:
    for stage in plan.stages:
        yield f"runs\t{stage.name}\t{_share(stage.share)}\t{_pointers(stage.pointers)}\t{stage.detail}"
    for stage in plan.pilot_samples:
        yield f"pilot samples\t{stage.name}\t\t{_pointers(stage.pointers)}\t{stage.detail}"
    for out in plan.left_out:
        yield f"left out\t{out.effect}\t\t{_pointers(out.pointers)}\t{out.reason}"
    yield f"cost\t{_cost(plan)}"


def _show_tables(plan: PlanDocument) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    runs = Table("What runs", "Time", "Asked for by", "What it does", box=box.SIMPLE_HEAD)
    for stage in plan.stages:
        runs.add_row(stage.name, _share(stage.share), _pointers(stage.pointers, "\n"), stage.detail)
    looks = Table("Pilot samples", "Asked for by", "What they do", box=box.SIMPLE_HEAD)
    for stage in plan.pilot_samples:
        looks.add_row(stage.name, _pointers(stage.pointers, "\n"), stage.detail)
    left_out = Table("Left out", "Named by", "Why", box=box.SIMPLE_HEAD)
    for out in plan.left_out:
        left_out.add_row(out.effect, _pointers(out.pointers, "\n"), out.reason)
    # Names of materials may look like markup.
    console = Console(markup=False, highlight=False)
    console.print(runs)
    if plan.pilot_samples:
        console.print(looks)
    if plan.left_out:
        console.print(left_out)
    console.print(_cost(plan))


def _cost(plan: PlanDocument) -> str:
    cost = plan.cost
    return (
        f"{cost.camera_rays:,} camera rays, at most {cost.shadow_rays:,} shadow rays, "
        f"about {cost.cpu_seconds:.2g} CPU seconds"
    )


def _share(share: float | None) -> str:
    return "" if share is None else f"{share:.0%}"


def _pointers(pointers: Sequence[str], separator: str = " ") -> str:
    shown = [output.harmless(pointer) or "(whole scene)" for pointer in pointers[:MOST_POINTERS]]
    more = [f"and {len(pointers) - MOST_POINTERS} more"] if len(pointers) > MOST_POINTERS else []
    return separator.join(shown + more)
