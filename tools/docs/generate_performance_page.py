"""Write docs/explanation/performance.md, its plot and README's sentence from what `make bench-peers` leaves.

`python -m tools.docs.generate_performance_page out/peers.json` takes the figures over.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

from benchmarks import peers_curves, peers_sentences, peers_tables
from benchmarks.peers_runs import PEER
from benchmarks.peers_settings import ERRORS_255, SCENES
from tools.docs import figures, fill_figures
from tools.docs.templates import table

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGE = DOCS / "explanation" / "performance.md"
README = ROOT / "README.md"
TEMPLATE = Path(__file__).with_name("performance_template.txt")
FIGURES = figures.FOLDER / "peers.json"
PLOT = DOCS / "images" / "performance" / "peers.svg"


def page(measured: dict[str, Any]) -> str:
    """The template with the tables and their sentences in their places."""
    rows, precisions = measured["comparisons"], measured["precisions"]
    peers = (f"{name} {version}" for name, version in measured["peers"].items())
    return TEMPLATE.read_text().format(
        equal=table(peers_tables.EQUAL_COLUMNS, map(peers_tables.equal_row, rows)),
        goals="\n".join(f"- {sentence}" for sentence in peers_sentences.of_goals(rows)),
        asked=table(peers_tables.ASKED_COLUMNS, map(peers_tables.asked_row, rows)),
        precision=table(peers_tables.PRECISION_COLUMNS, map(peers_tables.precision_row, precisions)),
        precision_goal=peers_sentences.of_precision(precisions),
        fixed=table(peers_tables.FIXED_COLUMNS, map(peers_tables.fixed_row, rows)),
        fixed_goal=peers_sentences.of_fixed(rows),
        machine=figures.measured_on(measured["machine"], peers),
        limits=table(peers_tables.LIMIT_COLUMNS, map(peers_tables.limit_row, measured["limits"])),
        limit_setting=measured["limits"][0]["setting"],
        settings="\n\n".join(_settings(scene, runs) for scene, runs in measured["scenes"].items()),
        runs=measured["runs"],
        short=measured["short_seconds"],
        longest=measured["longest_seconds"],
    )


def _settings(scene: str, runs: list[dict[str, Any]]) -> str:
    return f"**{scene}**\n\n" + table(peers_tables.RUN_COLUMNS, map(peers_tables.run_row, runs))


def _take_over(path: Path) -> None:
    """Keep the figures of a whole comparison, and draw them."""
    measured = json.loads(path.read_text())
    if [*measured["scenes"]] != [*SCENES] or measured["errors_255"] != [*ERRORS_255]:
        raise SystemExit(f"{path} does not have all scenes and errors: run `make bench-peers`")
    if PEER not in measured["peers"]:
        raise SystemExit(
            f"{path} has no {PEER} to compare with: docs/explanation/performance.md says how to install it"
        )
    if not measured["limits"]:
        raise SystemExit(f"{path} was measured with --quick: run `make bench-peers`")
    PLOT.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(path, FIGURES)
    peers_curves.draw(measured["scenes"], PLOT)


def main() -> None:
    """Take over the figures, and write the pages."""
    parser = argparse.ArgumentParser(
        description="Write docs/explanation/performance.md and the sentence of README."
    )
    parser.add_argument("measured", type=Path, help="what `make bench-peers` wrote: out/peers.json")
    _take_over(parser.parse_args().measured)
    PAGE.write_text(page(figures.read("peers")))
    README.write_text(fill_figures.filled(README.read_text()))
    print(f"wrote {PAGE} and the sentence of {README}")


if __name__ == "__main__":
    main()
