"""Where the service is the limit: what is busy, and who waits, against the number of slots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from benchmarks.capacity.figures import Figures

BLUE, RED = "#4477aa", "#ee6677"
"""From Paul Tol's bright scheme, which people with any colour vision tell apart."""


def draw(sweep: Sequence[Figures], path: Path) -> None:
    """Write the two panels as SVG, the same bytes for the same figures."""
    with mpl.rc_context({"svg.hashsalt": "penumbra", "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=(8, 3.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        _busy(left, sweep)
        _waits(right, sweep)
        figure.savefig(path, format="svg", metadata={"Date": None})


def _busy(panel: Axes, sweep: Sequence[Figures]) -> None:
    slots = [one["slots"] for one in sweep]
    panel.plot(slots, [100 * one["busy"] for one in sweep], color=RED, marker="o", label="service")
    panel.plot(slots, [100 * one["rendering"] for one in sweep], color=BLUE, marker="s", label="slots")
    panel.set(xscale="log", xlabel="slots", ylabel="busy, % of the time", ylim=(0, 105))
    panel.grid(visible=True, alpha=0.3)
    panel.legend()


def _waits(panel: Axes, sweep: Sequence[Figures]) -> None:
    slots = [one["slots"] for one in sweep]
    for place, (label, color, marker) in enumerate((("median", BLUE, "s"), ("99 of 100", RED, "o"))):
        waits = [one["times"]["all"]["first_tile"][place] for one in sweep]
        panel.plot(slots, waits, color=color, marker=marker, label=label)
    panel.set(xscale="log", yscale="log", xlabel="slots", ylabel="seconds to the first tile")
    panel.grid(visible=True, alpha=0.3)
    panel.legend()
