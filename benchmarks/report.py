"""Command line, CPU seconds, tables and output files, shared by all benchmarks."""

from __future__ import annotations

import argparse
import json
import resource
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Console
from rich.table import Table

import renderer
from accuracy.study.journal import describe

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Json = dict[str, Any]

OUT = Path("out")
SCENES = Path(__file__).parents[1] / "scenes"


def parser(part: str, about: str | None) -> argparse.ArgumentParser:
    """The command line of a part."""
    return argparse.ArgumentParser(prog=f"python -m benchmarks.{part}", description=about)


def uniform(samples: int, light: int) -> Json:
    """Sampling by grids: camera samples, and light points for each."""
    counts = {"antialiasing": samples, "light": light}
    return {name: {"pattern": "uniform", "samples": count} for name, count in counts.items()}


def cpu_seconds() -> float:
    """User and system time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def median_seconds(plan: renderer.RenderPlan, runs: int) -> float:
    """CPU seconds of a render in the median, after one that warms caches up."""
    renderer.render(plan)
    seconds = []
    for _ in range(runs):
        begun = cpu_seconds()
        renderer.render(plan)
        seconds.append(cpu_seconds() - begun)
    return statistics.median(seconds)


class Promise(NamedTuple):
    """A sentence, the figure that was measured, the limit that it is held to, and whether it is held."""

    promise: str
    measured: str
    limit: str
    held: bool


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
    show(name, Promise._fields, promises)
    keep(name, [one._asdict() for one in promises])
    if not all(one.held for one in promises):
        raise SystemExit(1)
