"""``penumbra validate`` and ``explain``: problems of a scene, and its plan."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import ExitCode, InputError, UnusableSceneError
from service.cli.options import JsonOption, LayersOption, SceneArgument
from service.cli.quality_options import QualityOptions, flattened_options
from service.cli.targets import parsed_layers

if TYPE_CHECKING:
    from rich.table import Table

    from renderer import LoadedScene, RenderPlan
    from schemas.api.plans import PlanDocument
    from schemas.errors import Problem

MOST_POINTERS = 3


@dataclass(frozen=True, slots=True)
class Finding:
    """The errors and warnings of one file."""

    name: str
    text: bytes = b""
    errors: Sequence[Problem] = ()
    warnings: Sequence[Problem] = ()
    more: int = 0

    @property
    def valid(self) -> bool:
        """Whether the file can be rendered."""
        return not self.errors


def validate(
    scenes: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files; - reads one from stdin.", show_default=False),
    ],
    as_json: JsonOption = False,
) -> None:
    """Show every error and warning of scene files, and where it is.

    Each has its pointer, line and column.
    """
    findings = [_examine(name) for name in scenes]
    valid = all(finding.valid for finding in findings)
    document = {"valid": valid, "files": [_as_document(finding) for finding in findings]}
    output.report(document, chain.from_iterable(map(_lines, findings)), as_json=as_json)
    if not valid:
        raise typer.Exit(ExitCode.UNUSABLE_INPUT)


def _examine(name: str) -> Finding:
    from schemas.errors import Problem

    try:
        file = scene_files.read(name)
        warnings = [*file.scene.warnings, *file.about_files(file.compiled())]
    except UnusableSceneError as error:
        return Finding(name, error.text, error.problems, more=error.more)
    except InputError as error:
        return Finding(name, errors=[Problem(pointer="", detail=str(error), code="not_readable")])
    return Finding(name, file.text, warnings=warnings)


def _lines(finding: Finding) -> Iterator[str]:
    counts = [(len(finding.errors) + finding.more, "error"), (len(finding.warnings), "warning")]
    counted = ", ".join(f"{count} {word}{'s' if count > 1 else ''}" for count, word in counts if count)
    yield f"{output.emphasis(output.harmless(finding.name))}: {counted or output.emphasis('ok', 'green')}"
    yield from output.excerpts(finding.text, finding.errors, finding.more)
    yield from output.excerpts(finding.text, finding.warnings, kind="warning")


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


@flattened_options
def explain(
    *,
    scene: SceneArgument,
    quality: QualityOptions,
    layers: LayersOption = None,
    cost: Annotated[
        bool,
        typer.Option(
            "--cost",
            help="Also measure what each effect costs: a small picture is rendered with and without it.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show what runs to render a scene, why, and the predicted cost.

    This plan has the stages, what requires each of them, and what is left out.
    """
    file = scene_files.load(scene)
    requested = quality.requested(file.scene.document.model_dump())
    plan = _priced(file.plan(requested, parsed_layers(layers)))
    measured = measured_costs(file.scene) if cost else None
    if as_json:
        output.document(plan.model_dump(mode="json") | ({"measured": measured} if measured else {}))
    elif output.on_terminal():
        output.show(*_tables(plan, measured))
    else:
        for line in _plain(plan, measured):
            output.result(line)


def _priced(plan: RenderPlan) -> PlanDocument:
    """The plan, with the cost of a picture on all processors of this machine."""
    from renderer.adaptive.forecast import price
    from renderer.processors import usable_processors

    return plan.describe().model_copy(update={"cost": price(plan, usable_processors())})


def _plain(plan: PlanDocument, measured: dict[str, Any] | None) -> Iterator[str]:
    for stage in plan.stages:
        yield f"runs\t{stage.name}\t{_share(stage.share)}\t{_pointers(stage.pointers)}\t{stage.detail}"
    for stage in plan.pilot_samples:
        yield f"pilot samples\t{stage.name}\t\t{_pointers(stage.pointers)}\t{stage.detail}"
    for out in plan.left_out:
        yield f"left out\t{out.effect}\t\t{_pointers(out.pointers)}\t{out.reason}"
    yield f"cost\t{_cost(plan)}"
    for row in measured["effects"] if measured else ():
        numbers = f"{row['seconds']:.4f}\t{row['difference'] * 255:.3f}"
        yield "\t".join(["measured", output.harmless(row["effect"]), numbers, *_shown(row["pointers"])])


def _tables(plan: PlanDocument, measured: dict[str, Any] | None) -> Iterator[Table | str]:
    yield output.table(
        ("What runs", "Time", "Asked for by", "What it does"),
        ([stage.name, _share(stage.share), _column(stage.pointers), stage.detail] for stage in plan.stages),
    )
    if plan.pilot_samples:
        yield output.table(
            ("Pilot samples", "Asked for by", "What they do"),
            ([stage.name, _column(stage.pointers), stage.detail] for stage in plan.pilot_samples),
        )
    if plan.left_out:
        yield output.table(
            ("Left out", "Named by", "Why"),
            ([out.effect, _column(out.pointers), out.reason] for out in plan.left_out),
        )
    yield _cost(plan)
    if measured:
        seconds = f"{measured['cpu_seconds']:.3f} CPU seconds"
        yield f"Measured on a small picture of {seconds}, each effect left out once:"
        yield output.table(
            ("Effect", "CPU seconds", "Share", "Difference x 255", "Asked for by"),
            map(_measured_cells, measured["effects"]),
        )


def _measured_cells(row: dict[str, Any]) -> tuple[str, ...]:
    numbers = (f"{row['seconds']:.3f}", f"{100 * row['share']:.0f} %", f"{row['difference'] * 255:.2f}")
    return (row["effect"], *numbers, "\n".join(_shown(row["pointers"][:MOST_POINTERS])))


def _cost(plan: PlanDocument) -> str:
    cost = plan.cost
    return (
        f"{cost.camera_rays:,} camera rays, at most {cost.shadow_rays:,} shadow rays, "
        f"about {cost.cpu_seconds:.2g} CPU seconds"
    )


def _share(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.0f} %"


def _pointers(pointers: Sequence[str], separator: str = " ") -> str:
    more = [f"and {len(pointers) - MOST_POINTERS} more"] if len(pointers) > MOST_POINTERS else []
    return separator.join([*_shown(pointers[:MOST_POINTERS]), *more])


def _column(pointers: Sequence[str]) -> str:
    return _pointers(pointers, "\n")


def _shown(pointers: Iterable[str]) -> list[str]:
    return [output.harmless(pointer) or "(whole scene)" for pointer in pointers]
