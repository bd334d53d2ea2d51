"""The error of a picture against CPU seconds, with logarithmic axes, as SVG or PNG."""

from __future__ import annotations

from math import inf
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from accuracy.plotting import BLUE, RED, drawn, number_plainly, reach
from renderer.convergence import NothingToFitError, PowerLaw, law_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_INCHES = (6.4, 4.2)
"""Width and height, inches."""

FRAME_FACTOR = 1.3
"""Factor between the curve and the frame."""

MAX_HALVING_COST = 30
"""Half the error is not marked if it takes this many times as long: the measured points would be crowded."""

LINE_LETTERS = 60
"""Letters in a line of a sentence on the plot."""


def draw(
    passes: Sequence[Mapping[str, Any]],
    *,
    form: str,
    title: str,
    target: float | None = None,
    unknown: str | None = None,
) -> bytes:
    """Draw a curve.

    Parameters
    ----------
    passes : sequence of mappings
        `cpu_seconds` and `error` when each pass ended, as reports have them.
    form : str
        "svg" or "png".
    title : str
    target : float, optional
        The target error.

    unknown : str, optional
        Text in place of the curve if no pass has an error.

    Raises
    ------
    MissingExtraError
        If the library that draws is not installed.
    """
    known = [entry for entry in passes if entry["error"] is not None]

    def fill_figure(figure: Figure) -> None:
        panel = figure.add_subplot()
        panel.set(title=title, xlabel="CPU seconds", ylabel="error (RMSE, linear, clipped to 0..1)")
        _fill(panel, known, target, unknown)

    return drawn(fill_figure, FIGURE_INCHES, form=form, font_size=10)


def _fill(
    panel: Axes, passes: Sequence[Mapping[str, Any]], target: float | None, unknown: str | None
) -> None:
    points = [entry for entry in passes if entry["cpu_seconds"] > 0 and entry["error"]["estimate"] > 0]
    if not points:
        text = fill(unknown or "No error above 0 is known yet.", LINE_LETTERS)
        panel.text(0.5, 0.5, text, transform=panel.transAxes, ha="center", va="center")
        panel.set(xticks=[], yticks=[])
        return
    panel.set(xscale="log", yscale="log")
    panel.grid(visible=True, which="both", alpha=0.25)
    times, errors = _points(panel, points)
    if target is not None:
        panel.axhline(target, color=RED, linewidth=1, label=f"asked for: {target:.2g}")
        errors.append(target)
    try:
        law = law_of(points)
    except NothingToFitError:
        pass
    else:
        _line(panel, law, times)
        _halving(panel, law, points[-1], (times, errors))
    _axes(panel, times, errors)
    panel.legend(frameon=False, fontsize="small")


def _points(panel: Axes, points: Sequence[Mapping[str, Any]]) -> tuple[list[float], list[float]]:
    """Draw the passes with the intervals of their errors; return the extent of the axes."""
    times = [entry["cpu_seconds"] for entry in points]
    intervals = [entry["error"] for entry in points]
    errors = [error["estimate"] for error in intervals]
    panel.plot(times, errors, color=BLUE, marker="o", markersize=4, label="passes", gid="passes")
    panel.errorbar(times, errors, yerr=reach(intervals), color=BLUE, linestyle="none", capsize=3)
    ends = [error[end] for error in intervals for end in ("low", "high")]
    return times, [*errors, *(end for end in ends if end > 0)]


def _line(panel: Axes, law: PowerLaw, times: Sequence[float]) -> None:
    order = law.order
    label = f"error ~ time^{order.estimate:.2f} ({order.low:.2f} to {order.high:.2f})"
    ends = [times[0], times[-1]]
    panel.plot(ends, law.at(ends), color="black", linewidth=1, linestyle="--", label=label)


def _halving(
    panel: Axes, law: PowerLaw, newest: Mapping[str, Any], shown: tuple[list[float], list[float]]
) -> None:
    """Mark half the error, if it is not too far away, and extend the axes to it."""
    spent, half = newest["cpu_seconds"], newest["error"]["estimate"] / 2
    cost = law.falling(spent)
    if cost is None or cost.estimate > MAX_HALVING_COST * spent:
        return
    high = cost.high if cost.high <= MAX_HALVING_COST * spent else cost.estimate
    bars = [[cost.estimate - cost.low], [high - cost.estimate]]
    end = "or more" if cost.high == inf else f"to {_short(cost.high)}"
    label = f"half the error: {_short(cost.estimate)} CPU s more ({_short(cost.low)} {end})"
    panel.errorbar(
        [spent + cost.estimate],
        [half],
        xerr=bars,
        color="black",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        linestyle="none",
        capsize=3,
        label=label,
    )
    shown[0].extend((spent + cost.low, spent + high))
    shown[1].append(half)


def _short(number: float) -> str:
    return f"{number:.0f}" if number >= 10 else f"{number:.2g}"


def _axes(panel: Axes, times: Sequence[float], errors: Sequence[float]) -> None:
    """Leave room around the curve, and write plain numbers on the axes."""
    for axis, limits, values in (
        (panel.xaxis, panel.set_xlim, times),
        (panel.yaxis, panel.set_ylim, errors),
    ):
        low, high = min(values), max(values)
        # At least a decade, so that there are numbers to read.
        room = max(FRAME_FACTOR, np.sqrt(10 * low / high))
        limits(low / room, high * room)
        many = high * room > 1000 * low / room
        number_plainly(axis, (1.0,) if many else (1.0, 2.0, 5.0))
