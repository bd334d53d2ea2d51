"""Measure on this machine: `make bench`, or `python -m benchmarks rendering`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks import (
    accuracy,
    bursts,
    effects,
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

PARTS = (
    "rendering",
    "effects",
    "meshes",
    "scaling",
    "accuracy",
    "targets",
    "passes",
    "quotes",
    "stability",
    "service",
    "bursts",
)


def main() -> None:
    """Measure the parts that are asked for, print them as tables and keep them as JSON."""
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


def _measure(parts: list[str], runs: int) -> dict[str, Any]:
    console = Console()
    measured: dict[str, Any] = {"machine": machine.describe()}
    console.print(tables.of_machine(measured["machine"]))
    if "rendering" in parts:
        measured["rendering"] = rendering.measure(runs)
        console.print(tables.of_rendering(measured["rendering"]), tables.of_stages(measured["rendering"]))
    if "effects" in parts:
        measured["effects"] = effects.measure(runs)
        console.print(tables.of_effects(measured["effects"]))
    if "meshes" in parts:
        measured["meshes"] = meshes.measure(runs)
        console.print(tables.of_meshes(measured["meshes"]))
    if "scaling" in parts:
        measured["scaling"] = scaling.measure(runs)
        console.print(tables.of_scaling(measured["scaling"]), tables.of_workers(measured["scaling"]))
    if "accuracy" in parts:
        measured["accuracy"] = accuracy.measure()
        console.print(tables.of_accuracy(measured["accuracy"]))
    if "targets" in parts:
        measured["targets"] = targets.measure()
        console.print(tables.of_targets(measured["targets"]))
    if "passes" in parts:
        measured["passes"] = passes.measure()
        console.print(tables.of_passes(measured["passes"]), tables.of_late(measured["passes"]))
    if "quotes" in parts:
        measured["quotes"] = quotes.measure()
        console.print(tables.of_quotes(measured["quotes"]))
    if "stability" in parts:
        measured["stability"] = stability.measure(runs)
        console.print(tables.of_prices(measured["stability"]["prices"]))
        console.print(tables.of_picture_errors(measured["stability"]["errors"]))
    return measured | _measure_service(parts, runs, console)


def _measure_service(parts: list[str], runs: int, console: Console) -> dict[str, Any]:
    measured: dict[str, Any] = {}
    if "service" in parts:
        measured["service"] = overhead.measure(runs)
        console.print(tables.of_overhead(measured["service"]))
    if "bursts" in parts:
        measured["bursts"] = bursts.measure()
        console.print(tables.of_bursts(measured["bursts"]))
    return measured


if __name__ == "__main__":
    main()
