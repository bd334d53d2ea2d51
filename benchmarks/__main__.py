"""Measure on this machine: `make bench`, or `python -m benchmarks rendering`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from benchmarks import (
    accuracy,
    bursts,
    effects,
    lists,
    machine,
    meshes,
    overhead,
    passes,
    quotes,
    rendering,
    scaling,
    stability,
    tables,
    targets,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Container

    from rich.table import Table

PARTS: dict[str, tuple[Callable[[int], Any], tuple[Callable[[Any], Table], ...]]] = {
    "rendering": (rendering.measure, (tables.of_rendering, tables.of_stages)),
    "effects": (effects.measure, (tables.of_effects,)),
    "meshes": (meshes.measure, (tables.of_meshes,)),
    "scaling": (scaling.measure, (tables.of_scaling, tables.of_workers)),
    "accuracy": (lambda _: accuracy.measure(), (tables.of_accuracy,)),
    "targets": (lambda _: targets.measure(), (tables.of_targets,)),
    "passes": (lambda _: passes.measure(), (tables.of_passes, tables.of_late)),
    "quotes": (lambda _: quotes.measure(), (tables.of_quotes,)),
    "stability": (stability.measure, (tables.of_prices, tables.of_picture_errors)),
    "service": (overhead.measure, (tables.of_overhead,)),
    "bursts": (lambda _: bursts.measure(), (tables.of_bursts,)),
    "lists": (lambda _: lists.measure(), (tables.of_lists,)),
}
"""What measures each part in so many runs, and its tables."""


def main() -> None:
    """Measure the requested parts, print them as tables and keep them as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Measure times and errors.")
    parser.add_argument("parts", nargs="*", default=[*PARTS], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--runs", type=int, default=5, help="runs of everything that is timed")
    parser.add_argument("--out", type=Path, default=Path("out/bench.json"), help="where to write the figures")
    options = parser.parse_args()
    if unknown := set(options.parts) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    measured = _measure(options.parts, options.runs)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(measured, indent=2) + "\n")
    Console(stderr=True).print(f"written to {options.out}")


def _measure(parts: Container[str], runs: int) -> dict[str, Any]:
    console = Console()
    measured: dict[str, Any] = {"machine": machine.describe()}
    console.print(tables.of_machine(measured["machine"]))
    for part, (measure, shown) in PARTS.items():
        if part in parts:
            measured[part] = measure(runs)
            console.print(*(table(measured[part]) for table in shown))
    return measured


if __name__ == "__main__":
    main()
