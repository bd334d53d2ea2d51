"""Tables of simulations, and the plot of a sweep: what is busy and who waits, against the number of slots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from accuracy.plotting import BLUE, RED, drawn

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.capacity.figures import Figures

HEADINGS = (
    "jobs",
    "users",
    "slots",
    "load",
    "service busy",
    "slots busy",
    "first tile, median",
    "99 %",
    "statements/s",
    "CPU ms a job taken",
    "CPU ms a task",
    "Jain",
)

SENDERS = ("jobs", "how many", "first tile, median", "99 %", "end, median", "99 %")


def rows(found: Sequence[Figures]) -> Iterator[tuple[str, ...]]:
    """Give a row of text for each simulation, as in ``HEADINGS``."""
    for one in found:
        median, most = one["times"]["all"]["first_tile"]
        yield (
            f"{one['jobs']:,}",
            f"{one['users']:,}",
            f"{one['slots']:,}",
            "all at once" if one["load"] is None else f"{one['load']:g}",
            f"{one['busy']:.0%}",
            f"{one['rendering']:.0%}",
            _seconds(median),
            _seconds(most),
            f"{one['statements']:,.0f}",
            f"{one['accept_ms']:.2f}",
            f"{one['task_ms']:.2f}",
            f"{one['jain']:.3f}",
        )


def by_sender(one: Figures) -> Iterator[tuple[str, ...]]:
    """Give a row of text for each kind of user: jobs, first tile and end, median and 99 of 100."""
    for name, times in one["times"].items():
        yield (
            name,
            f"{times['jobs']:,}",
            *(_seconds(value) for value in (*times["first_tile"], *times["end"])),
        )


def _seconds(value: float) -> str:
    return f"{value:.3g} s" if value < 1000 else f"{value:,.0f} s"


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
