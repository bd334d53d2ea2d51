"""Tables of simulations, for a terminal and for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

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
