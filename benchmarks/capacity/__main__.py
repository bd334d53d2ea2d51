"""Simulate clusters: `python -m benchmarks.capacity`, or with `--jobs 1000000` one of your choice."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.capacity import report
from benchmarks.capacity.figures import Figures, figures
from benchmarks.capacity.simulation import Simulation
from benchmarks.capacity.workloads import Workload
from benchmarks.machine import describe
from service import logs

if TYPE_CHECKING:
    from collections.abc import Sequence

CPU_SECONDS = 10.0
SWEEP = tuple(Workload(1000, 2000, slots, CPU_SECONDS, 0.9) for slots in (10, 30, 100, 300, 1000, 3000))
"""More and more slots, busy nine tenths of the time."""
CROWDS = (
    Workload(300, 1500, 30, CPU_SECONDS, 2.0),
    Workload(50, 1000, 30, CPU_SECONDS, float("inf"), even=True),
)
"""Twice the capacity; and a deadline, when all users send the same amount at once."""


def main() -> None:
    """Run simulations, print what they come to and keep it as JSON."""
    options = _options()
    logs.configure("error")
    console = Console()
    workloads = [*SWEEP, *CROWDS] if options.jobs is None else [_chosen(options)]
    found = [_run(workload, options.database, console) for workload in workloads]
    console.print(_table(report.HEADINGS, list(report.rows(found))))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    document = {"machine": describe(), "simulations": found}
    options.out.write_text(json.dumps(document, indent=2) + "\n")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.capacity", description=__doc__)
    parser.add_argument("--jobs", type=int, help="jobs of one simulation in place of the usual ones")
    parser.add_argument("--users", type=int, default=10_000)
    parser.add_argument("--slots", type=int, default=1000)
    parser.add_argument("--load", type=float, default=0.9, help="what arrives over what the slots render")
    parser.add_argument("--cpu-seconds", type=float, default=CPU_SECONDS, help="of a job")
    parser.add_argument("--database", help="SQLAlchemy URL of an empty database; SQLite by default")
    parser.add_argument("--out", type=Path, default=Path("out/capacity.json"), help="where the figures go")
    return parser.parse_args()


def _chosen(options: argparse.Namespace) -> Workload:
    return Workload(options.users, options.jobs, options.slots, options.cpu_seconds, options.load)


def _run(workload: Workload, url: str | None, console: Console) -> Figures:
    with TemporaryDirectory() as folder, Progress(console=console, transient=True) as bar:
        task = bar.add_task(f"{workload.slots:,} slots", total=workload.jobs)
        run = Simulation(workload, Path(folder), url)
        return figures(workload, run.run(lambda arrived: bar.update(task, completed=arrived)))


def _table(headings: Sequence[str], lines: Sequence[tuple[str, ...]]) -> Table:
    table = Table(title="Simulated clusters")
    for heading in headings:
        table.add_column(heading, justify="right")
    for line in lines:
        table.add_row(*line)
    return table


if __name__ == "__main__":
    main()
