"""Write docs/explanation/capacity.md, and draw its plot, from the kept figures of the simulated clusters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.capacity import report
from benchmarks.capacity.workloads import SIDE
from tools.docs import figures
from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Mapping

DOCS = Path(__file__).parents[2] / "docs"
IMAGE = DOCS / "images" / "capacity.svg"
PAGE = DOCS / "explanation" / "capacity.md"
TEMPLATE = Path(__file__).with_name("capacity_template.txt")


def page(measured: Mapping[str, Any]) -> str:
    """The template with figures in their places."""
    *sweep, crowd, rush = measured["simulations"]
    largest = sweep[-1]
    tasks = largest["tasks_each"]
    # Rounded first, so that the sum on the page is that of the figures beside it.
    accept_ms, task_ms = (round(largest[name], 2) for name in ("accept_ms", "task_ms"))
    job_ms = accept_ms + tasks * task_ms
    return TEMPLATE.read_text().format(
        side=SIDE,
        tasks=tasks,
        tiles=tasks - 1,
        cpu_seconds=largest["cpu_seconds"],
        sweep=table(report.HEADINGS, report.rows(sweep)),
        job_ms=job_ms,
        accept_ms=accept_ms,
        task_ms=task_ms,
        most=1000 / job_ms,
        crowd_users=crowd["users"],
        crowd=table(report.SENDERS, report.by_sender(crowd)),
        rush_users=rush["users"],
        each=rush["jobs"] // rush["users"],
        jain=rush["jain"],
        rush=table(report.SENDERS, report.by_sender(rush)),
        machine=figures.measured_on(measured["machine"]),
    )


def main() -> None:
    """Write the page and its plot."""
    measured = figures.read("capacity")
    report.draw(measured["simulations"][:-2], IMAGE)
    PAGE.write_text(page(measured))
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
