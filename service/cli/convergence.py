"""What the error of a job costs, in words: a line for each pass, and what the curve tells."""

from __future__ import annotations

from dataclasses import dataclass
from math import log2
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output
from service.cli.targets import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator

    from schemas.convergence import Convergence, Interval, PassCost
    from service.cli.progress import Bar
    from service.client import Client

FORMS = (".json", ".csv", ".svg", ".png")
"""Endings of the files that a curve can be saved as."""

CurveOption = Annotated[
    Path | None,
    typer.Option(
        "--convergence",
        metavar="FILE",
        help="Save what the error costs, pass by pass: .json, .csv, or a plot as .svg or .png.",
    ),
]

HEADINGS = ("pass", "seconds", "CPU s", "rays", "error")
WIDTHS = (4, 9, 9, 9, 27)
"""Columns of a table on a terminal."""

FULL = 20
"""Length of the bar of the first known error."""

CELLS = 2
"""By which a bar is shorter where the error is half as large."""


def save(client: Client, job_id: str, path: Path) -> None:
    """Write the curve of a job to a file; its ending chooses the form."""
    content = client.convergence_file(job_id, path.suffix.lower().removeprefix("."))
    write_whole(path, content)
    output.say(f"{path}: the error of {job_id} against time")


@dataclass(slots=True)
class Curve:
    """The passes of a job, shown as they end: on a terminal with a bar each, on a pipe with tabs."""

    client: Client
    job_id: str
    bar: Bar
    told: int = 0
    reached: int = 0
    found: Convergence | None = None
    first_error: float | None = None

    def reach(self, pass_index: int) -> None:
        """Show the passes before this one, a tile of which is there, as far as they are finished."""
        if pass_index <= self.reached:
            return
        self.reached = pass_index
        if self.found is None or len(self.found.passes) < pass_index:
            self.found = self.client.convergence(self.job_id)
        self._show_passes(self.found, pass_index)
        self.bar.below("\n".join(sentences(self.found, final=False)))

    def finish(self) -> None:
        """Show all passes of a job that has ended, and what they tell."""
        found = self.client.convergence(self.job_id)
        self._show_passes(found, len(found.passes))
        told = list(sentences(found, final=True))
        self.bar.below("\n".join(told))
        if not self.bar.visible:
            for sentence in told:
                output.result(sentence)

    def _show_passes(self, found: Convergence, before: int) -> None:
        for entry in found.passes[self.told : before]:
            if not self.bar.visible:
                output.result("\t".join(_words(entry)))
            else:
                if not self.told:
                    self.bar.above(_row(HEADINGS))
                self.bar.above(_row(_cells(entry)) + self._drawn(entry))
            self.told += 1

    def _drawn(self, entry: PassCost) -> str:
        """Draw an error: each half of it is as much shorter."""
        if entry.error is None or entry.error.estimate <= 0:
            return ""
        self.first_error = self.first_error or entry.error.estimate
        return "  " + self.bar.block * max(
            1, round(FULL + CELLS * log2(entry.error.estimate / self.first_error))
        )


def _row(cells: tuple[str, ...]) -> str:
    return "".join(
        cell.rjust(width) if place < len(WIDTHS) - 1 else "   " + cell.ljust(width)
        for place, (cell, width) in enumerate(zip(cells, WIDTHS, strict=True))
    )


def _cells(entry: PassCost) -> tuple[str, ...]:
    rays = f"{sum(entry.rays.values()) / 1e6:.2f} M"
    return (
        str(entry.pass_index),
        f"{entry.seconds:.2f}",
        f"{entry.cpu_seconds:.2f}",
        rays,
        _error(entry) or "-",
    )


def _words(entry: PassCost) -> Iterator[str]:
    yield f"pass {entry.pass_index} done"
    yield f"{entry.seconds:.2f} s"
    yield f"{entry.cpu_seconds:.2f} CPU s"
    yield f"{sum(entry.rays.values())} rays"
    yield f"error {_error(entry) or 'unknown'}"


def _error(entry: PassCost) -> str | None:
    return None if entry.error is None else output.reached_error(**entry.error.model_dump())


def sentences(found: Convergence, *, final: bool) -> Iterator[str]:
    """Say how fast the error falls and what half of it would cost.

    Parameters
    ----------
    final
        Nothing follows: where something is not known, say why.
    """
    known = [entry for entry in found.passes if entry.error is not None]
    if known:
        falls = f", falling like time to the power {_interval(found.order)}" if found.order else ""
        yield f"error {_error(known[-1])}{falls}"
    if found.next_halving is not None:
        seconds, cpu_seconds = found.next_halving.seconds, found.next_halving.cpu_seconds
        yield f"half of it would take {_interval(seconds, ' s more')}, {_interval(cpu_seconds, ' CPU s')}"
    if found.reason is not None and (final or found.order is not None):
        yield found.reason


def _interval(found: Interval, unit: str = "") -> str:
    """Write an estimate with its interval, in two digits."""
    end = "or more" if found.high is None else f"to {_short(found.high)}"
    return f"{_short(found.estimate)}{unit} ({_short(found.low)} {end})"


def _short(number: float) -> str:
    """Write a number with two digits or all before the point, never with an exponent where it is not small.

    >>> [_short(number) for number in (-0.507, 1234.5, 48.8, 0.0123)]
    ['-0.51', '1234', '49', '0.012']
    """
    return f"{number:.0f}" if abs(number) >= 10 else f"{number:.2g}"
