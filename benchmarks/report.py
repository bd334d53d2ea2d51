"""The machine, CPU seconds, and how a benchmark prints its table and keeps its figures."""

from __future__ import annotations

import json
import resource
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from rich.console import Console
from rich.table import Table

import renderer
from accuracy.study.journal import describe

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

OUT = Path("out")
SCENES = Path(__file__).parents[1] / "scenes"


def cpu_seconds() -> float:
    """User and system time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def timed_render(plan: renderer.RenderPlan) -> tuple[renderer.RenderResult, float]:
    """Render a plan in this process, and give the CPU seconds that it took beside the result."""
    begun = cpu_seconds()
    result = renderer.render(plan)
    return result, cpu_seconds() - begun


def median_seconds(plan: renderer.RenderPlan, runs: int) -> float:
    """CPU seconds of a render in the median, after one that warms caches up."""
    renderer.render(plan)
    return statistics.median(timed_render(plan)[1] for _ in range(runs))


class Promise(TypedDict):
    """A sentence, the figure that was measured, and the limit that it is held to."""

    promise: str
    measured: str
    held: bool
    limit: str
    details: dict[str, Any]


def promise(sentence: str, measured: str, *, held: bool, limit: str, **details: Any) -> Promise:
    """Make a promise of what was measured."""
    return Promise(promise=sentence, measured=measured, held=held, limit=limit, details=details)


def show(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table."""
    table = Table(*columns, title=title)
    for row in rows:
        table.add_row(*(f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in row))
    Console().print(table)


def keep(name: str, figures: Any) -> None:
    """Write figures and the machine into out/NAME.json."""
    OUT.mkdir(exist_ok=True)
    document = {"machine": describe(), "figures": figures}
    (OUT / f"{name}.json").write_text(json.dumps(document, indent=2) + "\n")
    Console(stderr=True).print(f"written to {OUT / name}.json")


def conclude(name: str, promises: list[Promise]) -> None:
    """Print and keep promises; the exit status is 1 if one is not held."""
    rows = [
        (one["promise"], one["measured"], one["limit"], "yes" if one["held"] else "NO") for one in promises
    ]
    show(name, ("promise", "measured", "limit", "held"), rows)
    keep(name, promises)
    if not all(one["held"] for one in promises):
        raise SystemExit(1)
