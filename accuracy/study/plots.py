"""Plots of a study as SVG, the same bytes for the same figures."""

from __future__ import annotations

import io
import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from accuracy.study import curves
from accuracy.study.settings import METHODS
from accuracy.study.words import amount, error
from renderer.errors import MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from matplotlib.axes import Axes

COLORS = dict(zip(METHODS, ("#4477aa", "#66ccee", "#ee6677", "#ccbb44", "#228833", "#aa3377"), strict=True))
"""Paul Tol's bright scheme, which people with any colour vision tell apart."""

GREY = "#aaaaaa"
TICKS = (1, 2, 5)
"""Of every power of ten, those that are labelled."""

SECONDS, RAYS, ERROR = "CPU seconds", "rays of all kinds", "RMSE x 255"

Row = curves.Row


def require() -> None:
    """Find out whether plots can be drawn.

    Raises
    ------
    MissingExtraError
        The library that draws them is not installed.
    """
    try:
        import matplotlib  # noqa: F401, PLC0415 - only a study needs it, and it takes a second to import
    except ModuleNotFoundError as missing:
        message = (
            "The plots of a study need matplotlib. Install it with: pip install 'penumbra-render[study]'"
        )
        raise MissingExtraError(message) from missing


def error_against(document: Mapping[str, Any], cost: Callable[[Row], float], name: str) -> str:
    """Error against seconds or rays: a line through the best settings of each method, the others faint."""
    spread = "cpu_seconds" if cost is curves.seconds else None
    with _drawn(name, SECONDS if spread else RAYS, document) as (axes, finish):
        for method, color in COLORS.items():
            own = [row for row in document["settings"] if row["method"] == method and row["told"]]
            best = curves.front(own, cost)
            axes.scatter(*_places(own, cost), color=color, s=9, alpha=0.35, linewidths=0)
            if best:
                _bars(axes, best, cost, spread, color)
                axes.plot(*_places(best, cost), color=color, marker="o", markersize=4, label=method)
    return finish()


def front(document: Mapping[str, Any]) -> str:
    """The settings that nothing beats, with their names, and all others grey."""
    with _drawn("front", SECONDS, document) as (axes, finish):
        told = [row for row in document["settings"] if row["told"]]
        best = curves.front(told)
        names = {row["name"] for row in best}
        beaten = [row for row in told if row["name"] not in names]
        axes.scatter(*_places(beaten, curves.seconds), color=GREY, s=14, label="beaten by another setting")
        axes.plot(*_places(best, curves.seconds), color="#222222", linewidth=1, zorder=1)
        for row in best:
            place = (curves.seconds(row), curves.error(row))
            axes.scatter(*place, color=COLORS[row["method"]], s=28, zorder=2)
            axes.annotate(row["name"], place, xytext=(5, 4), textcoords="offset points", fontsize=7)
    return finish()


def light_points(document: Mapping[str, Any], samples: int) -> str:
    """Error away from edges, where soft shadows are, against light points for so many camera samples."""
    with _drawn("light", "light points for each camera sample", document) as (axes, finish):
        for method, color in COLORS.items():
            own = [
                row
                for row in document["settings"]
                if row["method"] == method and row["camera_samples"] == samples and row["smooth_rmse_255"] > 0
            ]
            if own:
                points = [row["light_points"] for row in own]
                errors = [row["smooth_rmse_255"] for row in own]
                axes.plot(points, errors, color=color, marker="o", markersize=4, label=method)
        axes.set_ylabel(f"{ERROR}, away from edges")
    return finish()


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


@contextmanager
def _drawn(name: str, across: str, document: Mapping[str, Any]) -> Iterator[tuple[Axes, Callable[[], str]]]:
    """Axes in logarithms on which the reference's own error is drawn, and what gives the SVG at the end."""
    import matplotlib as mpl  # noqa: PLC0415 - see `require`
    from matplotlib.figure import Figure  # noqa: PLC0415 - see `require`
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: PLC0415 - see `require`

    svg: list[str] = []
    with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=(9.4, 4.6), layout="constrained")
        axes = figure.add_subplot()
        axes.set(xscale="log", yscale="log", xlabel=across, ylabel=ERROR)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=TICKS))
            axis.set_major_formatter(FuncFormatter(lambda value, _: amount(value)))
            axis.set_minor_formatter(NullFormatter())
        yield axes, lambda: svg[0]
        own = document["reference"]["rmse_255"]
        label = f"error of the reference itself, {error(own)}"
        # A picture without noise has a reference without error, which has no place on such an axis.
        style: dict[str, Any] = {"color": "#222222", "linewidth": 1, "linestyle": "--", "label": label}
        axes.axhline(own, **style) if own > 0 else axes.plot([], **style)
        axes.grid(visible=True, which="both", alpha=0.2)
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        svg.append(_inline(buffer.getvalue()))


def _inline(text: str) -> str:
    """The SVG element alone, as a page takes it in, and as wide as there is room."""
    element = text[text.index("<svg") :]
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", element)
    )
