"""Write docs/explanation/capacity.md from what `python -m benchmarks.capacity` left in out.

Run it as that page says. The figures are kept in docs, so that the page can be written again without
simulating.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.study.pages import table
from benchmarks.capacity import report
from benchmarks.capacity.workloads import SIDE

if TYPE_CHECKING:
    from collections.abc import Mapping

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MEASURED = ROOT / "out" / "capacity.json"
FIGURES = DOCS / "figures" / "capacity.json"
IMAGE = DOCS / "images" / "capacity.svg"
PAGE = DOCS / "explanation" / "capacity.md"
TEMPLATE = Path(__file__).with_name("capacity_template.txt")


def page(measured: Mapping[str, Any]) -> str:
    """The template with figures in their places."""
    *sweep, crowd, rush = measured["simulations"]
    largest = sweep[-1]
    job_ms = largest["accept_ms"] + largest["tasks_each"] * largest["task_ms"]
    return TEMPLATE.read_text().format(
        side=SIDE,
        steps=largest["tasks_each"] - 1,
        cpu_seconds=largest["cpu_seconds"],
        sweep=table(report.HEADINGS, report.rows(sweep)),
        job_ms=job_ms,
        accept_ms=largest["accept_ms"],
        task_ms=largest["task_ms"],
        most=1000 / job_ms,
        crowd_users=crowd["users"],
        crowd=table(report.SENDERS, report.by_sender(crowd)),
        rush_users=rush["users"],
        each=rush["jobs"] // rush["users"],
        jain=rush["jain"],
        rush=table(report.SENDERS, report.by_sender(rush)),
        machine=_machine(measured["machine"]),
    )


def _machine(machine: Mapping[str, Any]) -> str:
    return (
        f"Simulated on {machine['date'][:10]} on one core of {machine['cpu']} with Python "
        f"{machine['python']} and Penumbra {machine['penumbra']}; the load before it began was "
        f"{machine['load']:g}."
    )


def main() -> None:
    """Take over the figures, and write the page and its plot."""
    if MEASURED.exists():
        shutil.copyfile(MEASURED, FIGURES)
    measured = json.loads(FIGURES.read_text())
    report.draw(measured["simulations"][:-2], IMAGE)
    PAGE.write_text(page(measured))
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
