"""Where the service is the limit: what is busy, and who waits, against the number of slots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from accuracy.plotting import BLUE, RED, drawn

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.capacity.figures import Figures


def draw(sweep: Sequence[Figures], path: Path) -> None:
    """Write the two panels as SVG, the same bytes for the same figures."""

    def fill(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        _busy(left, sweep)
        _waits(right, sweep)

    path.write_bytes(drawn(fill, (8, 3.2)))


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
