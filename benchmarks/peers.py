"""Three renderers, the same scenes, one sitting: CPU seconds at equal error. Run it with `make bench-peers`.

Each picture is compared with a converged reference. Seconds are user and system time of all threads, without
loading and compiling: POV-Ray's are those of its process less those of a picture of nothing.

`python -m benchmarks.peers --quick soft` compares one scene in a minute: fewer errors, single runs.
"""

from __future__ import annotations

import argparse
import json
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from benchmarks import (
    machine,
    peers_curves,
    peers_limit,
    peers_runs,
    peers_tables,
    povray_pictures,
    references,
)
from benchmarks.peers_comparison import comparisons, precisions
from benchmarks.peers_settings import ERRORS_255, FULL, QUICK, SCENES, Effort
from benchmarks.tables import of_machine

if TYPE_CHECKING:
    from collections.abc import Sequence

QUICK_ERRORS_255 = (4.0, 2.0, 1.0, 0.5)


def main() -> None:
    """Measure the requested scenes, print the comparison and keep it as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description="Compare renderers.")
    parser.add_argument("scenes", nargs="*", default=[*SCENES], metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument(
        "--errors", nargs="+", type=float, metavar="E", help="true errors to compare at, in units of 1/255"
    )
    parser.add_argument(
        "--quick", action="store_true", help="single runs of a few seconds at most, no POV-Ray"
    )
    parser.add_argument("--out", type=Path, default=Path("out/peers.json"), help="where to write the figures")
    options = parser.parse_args()
    if unknown := set(options.scenes) - set(SCENES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    if not all(0.001 <= error <= 100 for error in options.errors or ()):
        parser.error("errors are from 0.001 to 100, in units of 1/255: --errors 2 1 0.5")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    effort, errors = (QUICK, QUICK_ERRORS_255) if options.quick else (FULL, ERRORS_255)
    _measure(options.scenes, options.errors or errors, effort, options.out)


def _measure(scenes: list[str], errors_255: Sequence[float], effort: Effort, out: Path) -> None:
    """Print and keep what there is after each scene: all of them take long."""
    console = Console()
    errors = sorted({round(error, 4) for error in errors_255}, reverse=True)
    measured: dict[str, Any] = {"machine": machine.describe(), "peers": _peers(console)}
    measured |= {"runs": effort.runs, "short_seconds": peers_runs.SHORT, "longest_seconds": effort.longest}
    measured |= {"errors_255": errors, "references": {}, "scenes": {}, "limits": []}
    console.print(of_machine(measured["machine"]))
    for scene in scenes:
        measured["references"][scene] = references.load(scene)[1].own_error_255
        measured["scenes"][scene] = list(peers_runs.runs_of(scene, errors, effort))
        if effort.thorough:
            measured["limits"].append(peers_limit.measure(scene))
        rows = map(peers_tables.run_row, measured["scenes"][scene])
        console.print(peers_tables.table(scene, peers_tables.RUN_COLUMNS, rows))
        _keep(measured, errors, out)
    _print(measured, console)
    Console(stderr=True).print(f"written to {out} and {_plot(out)}")


def _keep(measured: dict[str, Any], errors_255: Sequence[float], out: Path) -> None:
    measured["comparisons"] = comparisons(measured["scenes"], errors_255)
    measured["precisions"] = precisions(measured["scenes"])
    out.write_text(json.dumps(measured, indent=2) + "\n")
    peers_curves.draw(measured["scenes"], _plot(out))


def _print(measured: dict[str, Any], console: Console) -> None:
    rows = measured["comparisons"]
    for title, columns, cells in (
        ("CPU seconds at equal true error", peers_tables.EQUAL_COLUMNS, map(peers_tables.equal_row, rows)),
        ("What you get when you ask for it", peers_tables.ASKED_COLUMNS, map(peers_tables.asked_row, rows)),
        ("Beside fixed samples, CPU s", peers_tables.FIXED_COLUMNS, map(peers_tables.fixed_row, rows)),
        (
            "True error over the one asked for",
            peers_tables.PRECISION_COLUMNS,
            map(peers_tables.precision_row, measured["precisions"]),
        ),
        (
            "NumPy's own limit",
            peers_tables.LIMIT_COLUMNS,
            map(peers_tables.limit_row, measured["limits"]),
        ),
    ):
        table = peers_tables.table(title, columns, cells)
        if table.rows:
            console.print(table)


def _plot(out: Path) -> Path:
    return out.with_suffix(".svg")


def _peers(console: Console) -> dict[str, str]:
    """Versions of the other renderers; says which are missing."""
    peers = {
        "Mitsuba": version("mitsuba") if peers_runs.mitsuba() else None,
        "POV-Ray": povray_pictures.version(),
    }
    for name, found in peers.items():
        if found is None:
            console.print(
                f"{name} is not installed and is left out; "
                "docs/explanation/performance.md says how to install it"
            )
    return {name: found for name, found in peers.items() if found is not None}


if __name__ == "__main__":
    main()
