"""Error against CPU seconds of every setting, a panel for each scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from accuracy.plotting import BLUE, CYAN, GREEN, RED, drawn
from benchmarks.peers_curves import front, runs_by
from benchmarks.peers_runs import RENDERERS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.peers_runs import Run

COLORS = dict(zip(RENDERERS, (RED, GREEN, BLUE, CYAN), strict=True))
COLUMNS = 3


def draw(scenes: Mapping[str, Sequence[Run]], path: Path) -> None:
    """Write the panels as SVG, the same bytes for the same figures."""
    rows = -(-len(scenes) // COLUMNS)

    def fill(figure: Figure) -> None:
        for place, (scene, runs) in enumerate(scenes.items(), start=1):
            _panel(figure.add_subplot(rows, COLUMNS, place), scene, runs)

    path.write_bytes(drawn(fill, (4 * COLUMNS, 3.4 * rows)))


def _panel(panel: Axes, scene: str, runs: Sequence[Run]) -> None:
    for name, color in COLORS.items():
        own = runs_by(name, runs)
        if not own:
            continue
        best = front(own)
        panel.scatter(*_places(own), color=color, s=10, alpha=0.4, linewidths=0)
        panel.plot(*_places(best), color=color, marker="o", markersize=4, label=name)
    panel.set(xscale="log", yscale="log", title=scene, xlabel="CPU seconds", ylabel="RMSE x 255")
    panel.grid(visible=True, which="both", alpha=0.2)
    panel.legend(frameon=False)


def _places(runs: Sequence[Run]) -> tuple[list[float], list[float]]:
    return [run["cpu_seconds"] for run in runs], [run["rmse_255"] for run in runs]
