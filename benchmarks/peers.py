"""Three renderers, the same scenes, one sitting: CPU seconds at equal error. Run it with `make bench-peers`.

Each picture is compared with a converged reference. Seconds are user and system time of all threads, without
loading and compiling: POV-Ray's are those of its process less those of a picture of nothing.
"""

from __future__ import annotations

import argparse
import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks import machine, peers_limit, peers_plot, peers_runs, peers_tables, povray_pictures, tables
from benchmarks.peers_settings import SCENES


def main() -> None:
    """Measure the scenes that are asked for, print the comparison and keep it as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description="Compare renderers.")
    parser.add_argument("scenes", nargs="*", default=[*SCENES], metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--out", type=Path, default=Path("out/peers.json"), help="where to write the figures")
    options = parser.parse_args()
    if unknown := set(options.scenes) - set(SCENES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    _measure(options.scenes, options.out, Console())
    Console(stderr=True).print(f"written to {options.out} and {_plot(options.out)}")


def _measure(scenes: list[str], out: Path, console: Console) -> None:
    """Print and keep what there is after each scene: all of them take long."""
    measured: dict[str, Any] = {"machine": machine.describe(), "peers": _peers(console)}
    measured |= {"scenes": {}, "limits": []}
    console.print(tables.of_machine(measured["machine"]))
    for scene in scenes:
        measured["scenes"][scene] = list(peers_runs.runs_of(scene))
        measured["limits"].append(peers_limit.measure(scene))
        console.print(peers_tables.of_runs(scene, measured["scenes"][scene]))
        out.write_text(json.dumps(measured, indent=2) + "\n")
        peers_plot.draw(measured["scenes"], _plot(out))
    console.print(peers_tables.of_ratios(measured["scenes"]), peers_tables.of_limits(measured["limits"]))


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
                f"{name} is not installed and is left out; docs/performance.md tells how to install it"
            )
    return {name: found for name, found in peers.items() if found is not None}


if __name__ == "__main__":
    main()
