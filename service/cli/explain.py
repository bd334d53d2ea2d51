"""``penumbra explain``: what a scene makes the renderer do, who asked, and what is left out."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import layers as layer_files
from service.cli import measured_costs, output, qualities, scene_files

if TYPE_CHECKING:
    from renderer import RenderPlan
    from schemas.plans import PlanDocument

MOST_POINTERS = 3

CostOption = Annotated[
    bool,
    typer.Option(
        "--cost",
        help="Also measure what each effect costs: a small picture is rendered with and without it.",
    ),
]


def explain(  # noqa: PLR0913 - one argument for each option
    *,
    scene: scene_files.SceneArgument,
    samples: qualities.SamplesOption = None,
    pattern: qualities.PatternOption = None,
    light_samples: qualities.LightSamplesOption = None,
    light_pattern: qualities.LightPatternOption = None,
    precision: qualities.PrecisionOption = None,
    target_error: qualities.TargetErrorOption = None,
    confidence: qualities.ConfidenceOption = None,
    time_limit: qualities.TimeLimitOption = None,
    layers: layer_files.LayersOption = None,
    cost: CostOption = False,
    as_json: output.JsonOption = False,
) -> None:
    """Show the plan of a scene: its stages, who asked for each, what is left out, the predicted cost."""
    file = scene_files.load(scene)
    quality = qualities.quality(
        file.scene.document.model_dump(),
        samples=samples,
        pattern=pattern,
        light_samples=light_samples,
        light_pattern=light_pattern,
        precision=precision,
        target_error=target_error,
        confidence=confidence,
        time_limit=time_limit,
    )
    plan = _priced(file.plan(quality, layer_files.parsed(layers)))
    measured = measured_costs.measure(file.scene) if cost else None
    if as_json:
        output.document(plan.model_dump(mode="json") | ({"measured": measured} if measured else {}))
    elif output.on_terminal():
        _show_tables(plan)
    else:
        for line in _plain(plan):
            output.result(line)
    if measured and not as_json:
        measured_costs.show(measured)


def _priced(plan: RenderPlan) -> PlanDocument:
    """The plan, with the price of a picture that all processors of this machine render."""
    from accuracy.quotes.prices import price

    return plan.describe().model_copy(update={"cost": price(plan, len(os.sched_getaffinity(0)))})


def _plain(plan: PlanDocument) -> Iterable[str]:
    for stage in plan.stages:
        yield f"runs\t{stage.name}\t{_share(stage.share)}\t{_pointers(stage.pointers)}\t{stage.detail}"
    for stage in plan.first_looks:
        yield f"first looks\t{stage.name}\t\t{_pointers(stage.pointers)}\t{stage.detail}"
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
    looks = Table("First looks", "Asked for by", "What they do", box=box.SIMPLE_HEAD)
    for stage in plan.first_looks:
        looks.add_row(stage.name, _pointers(stage.pointers, "\n"), stage.detail)
    left_out = Table("Left out", "Named by", "Why", box=box.SIMPLE_HEAD)
    for out in plan.left_out:
        left_out.add_row(out.effect, _pointers(out.pointers, "\n"), out.reason)
    # Names of materials may look like markup.
    console = Console(markup=False, highlight=False)
    console.print(runs)
    if plan.first_looks:
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
