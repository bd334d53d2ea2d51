"""Write docs/performance.md from what `make bench-peers` left in out. Run it as that page says.

The figures and the plot are kept in docs, so that the page can be written again without measuring.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks import peers_tables, references
from benchmarks.peers_runs import RUNS, SHORT

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

DOCS = Path(__file__).parent
MEASURED = DOCS.parent / "out"
PAGE = DOCS / "performance.md"
TEMPLATE = DOCS / "performance_template.txt"
FIGURES = DOCS / "figures" / "peers.json"
PLOT = DOCS / "images" / "performance" / "peers.svg"


def page(measured: dict[str, Any]) -> str:
    """The template with the tables in their places."""
    scenes = measured["scenes"]
    errors = (f"{references.load(scene)[1].own_error_255:.3f}/255 ({scene})" for scene in scenes)
    return TEMPLATE.read_text().format(
        ratios=table(peers_tables.RATIO_COLUMNS, peers_tables.ratio_rows(scenes)),
        machine=_machine(measured),
        limits=table(peers_tables.LIMIT_COLUMNS, map(peers_tables.limit_row, measured["limits"])),
        limit_setting=measured["limits"][0]["setting"],
        settings="\n\n".join(_settings(scene, runs) for scene, runs in scenes.items()),
        own_errors=", ".join(errors),
        runs=RUNS,
        short=SHORT,
    )


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _settings(scene: str, runs: list[dict[str, Any]]) -> str:
    return f"**{scene}**\n\n" + table(peers_tables.RUN_COLUMNS, map(peers_tables.run_row, runs))


def _machine(measured: dict[str, Any]) -> str:
    machine = measured["machine"]
    peers = ", ".join(f"{name} {version}" for name, version in measured["peers"].items())
    return (
        f"Measured on {machine['date'][:10]} on {machine['cores']} cores of {machine['cpu']} with {peers}, "
        f"Python {machine['python']} and NumPy {machine['numpy']}. "
        f"The load before it began was {machine['load']}."
    )


def main() -> None:
    """Take over the figures and the plot, and write the page."""
    PLOT.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(MEASURED / "peers.json", FIGURES)
    shutil.copyfile(MEASURED / "peers.svg", PLOT)
    PAGE.write_text(page(json.loads(FIGURES.read_text())))
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
