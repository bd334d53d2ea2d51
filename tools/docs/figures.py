"""Measured figures: the files that pages are written from, and the command that makes each of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

FOLDER = Path(__file__).parents[2] / "docs" / "figures"

COMMANDS = {
    "assignment": (
        "python -m tools.docs.generate_assignment_page --measure && python -m tools.docs.measure_programs"
    ),
    "bench": "python -m benchmarks rendering effects meshes accuracy service --out docs/figures/bench.json",
    "capacity": "python -m benchmarks.capacity --out docs/figures/capacity.json",
    "chaos": "python -m benchmarks.chaos --out docs/figures/chaos.json",
    "class": "python -m tools.docs.measure_likeness && python -m tools.docs.measure_class",
    "hard_cases": "python -m tools.docs.generate_numerics_reference",
    "intervals": "python -m benchmarks.intervals --out docs/figures/intervals.json",
    "lists": "python -m benchmarks lists --out docs/figures/lists.json",
    "load": "python -m benchmarks.load --out docs/figures/load.json",
    "noise": "python -m tools.docs.measure_noise",
    "page": "python -m benchmarks.page_paint --out docs/figures/page.json",
    "peers": "make bench-peers && python -m tools.docs.generate_performance_page out/peers.json",
    "jobs": "python -m benchmarks quotes bursts --out docs/figures/jobs.json",
    "soak": "python -m benchmarks.chaos --soak --out docs/figures/soak.json",
    "stability": "python -m benchmarks stability --runs 9 --out docs/figures/stability.json",
    "study": "make study && python -m tools.docs.generate_accuracy_page",
    "targets": "python -m benchmarks targets --out docs/figures/targets.json",
}
"""What measures the figures of each name again, and leaves them in `FOLDER`."""


class MissingFiguresError(SystemExit):
    """A page cannot be written, as its figures are not kept: the script ends with this message."""


def read(name: str) -> Any:
    """Give the figures of a name, or say how to measure them.

    Raises
    ------
    MissingFiguresError
        If they are not kept. The message has the command that measures them.
    """
    path = FOLDER / f"{name}.json"
    if not path.exists():
        raise MissingFiguresError(f"docs/figures/{path.name} is missing. To make it: {COMMANDS[name]}")
    return json.loads(path.read_text(encoding="utf-8"))


def measured_on(machine: Mapping[str, Any], beside: Iterable[str] = ()) -> str:
    """Say when and on what figures were measured; `beside` are other programs with their versions."""
    numpy = [f"NumPy {machine['numpy']}"] if "numpy" in machine else []
    *others, last = [*beside, f"Python {machine['python']}", *numpy]
    programs = f"{', '.join(others)} and {last}" if others else last
    on = f"{machine['date'][:10]} on {machine['cores']} cores of {machine['cpu']}"
    load = f" The load before it began was {machine['load']:g}." if "load" in machine else ""
    return f"Measured on {on} with {programs}.{load}"
