"""Error against CPU seconds as a curve: the settings that no cheaper one beats, between them, and a plot."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from accuracy.plotting import BLUE, CYAN, GREEN, RED, drawn
from benchmarks.peers_runs import RENDERERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.peers_runs import Run


COLORS = dict(zip(RENDERERS, (RED, GREEN, BLUE, CYAN), strict=True))
COLUMNS = 3


def runs_by(renderer: str, runs: Iterable[Run]) -> list[Run]:
    """Those of one renderer."""
    return [run for run in runs if run["renderer"] == renderer]


def front(runs: Iterable[Run]) -> list[Run]:
    """Those of runs that come nearer than all cheaper ones, the cheapest first.

    Examples
    --------
    >>> runs = [{"cpu_seconds": s, "rmse_255": e} for s, e in ((3.0, 1.0), (2.0, 4.0), (1.0, 3.0))]
    >>> [run["rmse_255"] for run in front(runs)]
    [3.0, 1.0]
    """
    nearer: list[Run] = []
    for run in sorted(runs, key=lambda run: (run["cpu_seconds"], run["rmse_255"])):
        if not nearer or run["rmse_255"] < nearer[-1]["rmse_255"]:
            nearer.append(run)
    return nearer


def seconds_at(runs: Iterable[Run], error_255: float) -> float | None:
    """CPU seconds that one renderer takes to an error, interpolated along the front of its runs.

    Between two runs the logarithm of the seconds is linear in the logarithm of the error. An error that even
    the cheapest run comes under costs as much as that run; one that no run comes under is not reached.

    Returns
    -------
    float or None
        None where the error is not reached.

    Examples
    --------
    >>> runs = [{"cpu_seconds": s, "rmse_255": e} for s, e in ((1.0, 4.0), (4.0, 1.0))]
    >>> [seconds_at(runs, error) for error in (8.0, 2.0, 0.5)]
    [1.0, 2.0, None]
    """
    best = front(runs)
    if not best or error_255 < best[-1]["rmse_255"]:
        return None
    if error_255 >= best[0]["rmse_255"]:
        return best[0]["cpu_seconds"]
    coarser, nearer = next(pair for pair in pairwise(best) if pair[1]["rmse_255"] <= error_255)
    if nearer["rmse_255"] == 0:  # nearer than can be measured: there is no curve to it
        return nearer["cpu_seconds"]
    way = math.log(coarser["rmse_255"] / error_255) / math.log(coarser["rmse_255"] / nearer["rmse_255"])
    return coarser["cpu_seconds"] * math.pow(nearer["cpu_seconds"] / coarser["cpu_seconds"], way)


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
