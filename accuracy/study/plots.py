"""Plots of a study as SVG, the same bytes for the same figures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from accuracy.plotting import BLUE, CYAN, GREEN, PURPLE, RED, YELLOW, drawn, number_plainly
from accuracy.study import curves
from accuracy.study.settings import METHODS
from accuracy.study.words import amount, error

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = dict(zip(METHODS, (BLUE, CYAN, RED, YELLOW, GREEN, PURPLE), strict=True))

GREY = "#aaaaaa"
SIZE = (9.4, 4.6)
"""Inches."""

TICKS = (1, 2, 5)
"""Of every power of ten, those that are labelled."""

SECONDS, RAYS, ERROR = "CPU seconds", "rays of all kinds", "RMSE x 255"

Row = curves.Row


def error_against(document: Mapping[str, Any], cost: Callable[[Row], float], name: str) -> str:
    """Error against seconds or rays: a line through the best settings of each method, the others faint."""
    spread = "cpu_seconds" if cost is curves.seconds else None

    def fill(axes: Axes) -> None:
        for method, color in COLORS.items():
            own = [row for row in document["settings"] if row["method"] == method and row["told"]]
            best = curves.front(own, cost)
            axes.scatter(*_places(own, cost), color=color, s=9, alpha=0.35, linewidths=0)
            if best:
                _bars(axes, best, cost, spread, color)
                axes.plot(*_places(best, cost), color=color, marker="o", markersize=4, label=method)

    return _svg(fill, name, SECONDS if spread else RAYS, document)


def front(document: Mapping[str, Any]) -> str:
    """The settings that nothing beats, with their names, and all others grey."""
    told = [row for row in document["settings"] if row["told"]]
    best = curves.front(told)
    names = {row["name"] for row in best}
    beaten = [row for row in told if row["name"] not in names]

    def fill(axes: Axes) -> None:
        axes.scatter(*_places(beaten, curves.seconds), color=GREY, s=14, label="beaten by another setting")
        axes.plot(*_places(best, curves.seconds), color="#222222", linewidth=1, zorder=1)
        for row in best:
            place = (curves.seconds(row), curves.error(row))
            axes.scatter(*place, color=COLORS[row["method"]], s=28, zorder=2)
            axes.annotate(row["name"], place, xytext=(5, 4), textcoords="offset points", fontsize=7)

    return _svg(fill, "front", SECONDS, document)


def light_points(document: Mapping[str, Any], samples: int) -> str:
    """Error away from edges, where soft shadows are, against light points for so many camera samples."""
    rows = [row for row in document["settings"] if row["camera_samples"] == samples]

    def fill(axes: Axes) -> None:
        for method, color in COLORS.items():
            own = [row for row in rows if row["method"] == method and row["smooth_rmse_255"] > 0]
            if own:
                points = [row["light_points"] for row in own]
                errors = [row["smooth_rmse_255"] for row in own]
                axes.plot(points, errors, color=color, marker="o", markersize=4, label=method)
        axes.set_ylabel(f"{ERROR}, away from edges")

    return _svg(fill, "light", "light points for each camera sample", document)


def _places(rows: Sequence[Row], cost: Callable[[Row], float]) -> tuple[list[float], list[float]]:
    return [cost(row) for row in rows], [curves.error(row) for row in rows]


def _bars(
    axes: Axes, rows: Sequence[Row], cost: Callable[[Row], float], spread: str | None, color: str
) -> None:
    across = _reach(rows, spread) if spread else None
    axes.errorbar(
        *_places(rows, cost),
        xerr=across,
        yerr=_reach(rows, "rmse_255"),
        color=color,
        fmt="none",
        elinewidth=1,
        capsize=2,
    )


def _reach(rows: Sequence[Row], member: str) -> list[list[float]]:
    """How far intervals reach below and above."""
    values = [row[member] for row in rows]
    return [
        [max(0.0, value["estimate"] - value["low"]) for value in values],
        [max(0.0, value["high"] - value["estimate"]) for value in values],
    ]


def _svg(fill: Callable[[Axes], None], name: str, across: str, document: Mapping[str, Any]) -> str:
    """Error against what lies `across`, in logarithms, with the reference's own error and a legend."""

    def fill_figure(figure: Figure) -> None:
        axes = figure.add_subplot()
        axes.set(xscale="log", yscale="log", xlabel=across, ylabel=ERROR)
        for axis in (axes.xaxis, axes.yaxis):
            number_plainly(axis, TICKS, amount)
        fill(axes)
        own = document["reference"]["rmse_255"]
        label = f"error of the reference itself, {error(own)}"
        # A picture without noise has a reference without error, which has no place on such an axis.
        style: dict[str, Any] = {"color": "#222222", "linewidth": 1, "linestyle": "--", "label": label}
        axes.axhline(own, **style) if own > 0 else axes.plot([], **style)
        axes.grid(visible=True, which="both", alpha=0.2)
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))

    return _inline(drawn(fill_figure, SIZE, salt=name).decode())


def _inline(text: str) -> str:
    """The SVG element alone, as a page takes it in, and as wide as there is room."""
    element = text[text.index("<svg") :]
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", element)
    )
