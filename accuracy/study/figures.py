"""Figures of a report: plots as SVG, and rows of pictures side by side."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from accuracy.plotting import BLUE, CYAN, GREEN, PURPLE, RED, YELLOW, drawn, number_plainly, reach
from accuracy.statistics import clipped
from accuracy.study import curves
from accuracy.study.settings import METHODS
from accuracy.study.words import amount, error
from renderer.images.files import encode_png
from schemas.scene import Display

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from accuracy.study.reference import Reference
    from renderer.math.arrays import Floats

COLORS = dict(zip(METHODS, (BLUE, CYAN, RED, YELLOW, GREEN, PURPLE), strict=True))

GREY = "#aaaaaa"
FIGURE_INCHES = (9.4, 4.6)
"""Inches."""

TICKS = (1, 2, 5)
"""Multiples of every power of ten that are labelled."""

SECONDS, RAYS, ERROR = "CPU seconds", "rays of all kinds", "RMSE x 255"

Row = curves.Row

DIFFERENCE_GAIN = 16
"""Factor of displayed differences: one step of 8 bits becomes 16, which is visible beside grey."""

DETAIL_PARTS = 8
"""The enlarged part is this fraction of the shorter side."""

MIN_DETAIL_PIXELS = 256
"""Least side of the enlarged part, pixels."""


def error_against(document: Mapping[str, Any], cost: Callable[[Row], float], name: str) -> str:
    """Error against seconds or rays: a line through the best settings of each method, the others faint."""
    interval = "cpu_seconds" if cost is curves.seconds else None

    def fill(axes: Axes) -> None:
        for method, color in COLORS.items():
            own = [row for row in document["settings"] if row["method"] == method and row["resolved"]]
            best = curves.front(own, cost)
            axes.scatter(*_places(own, cost), color=color, s=9, alpha=0.35, linewidths=0)
            if best:
                _bars(axes, best, cost, interval, color)
                axes.plot(*_places(best, cost), color=color, marker="o", markersize=4, label=method)

    return _svg(fill, name, SECONDS if interval else RAYS, document)


def front(document: Mapping[str, Any]) -> str:
    """The settings on the front, with their names, and all others in grey."""
    known = [row for row in document["settings"] if row["resolved"]]
    best = curves.front(known)
    names = {row["name"] for row in best}
    beaten = [row for row in known if row["name"] not in names]

    def fill(axes: Axes) -> None:
        axes.scatter(*_places(beaten, curves.seconds), color=GREY, s=14, label="beaten by another setting")
        axes.plot(*_places(best, curves.seconds), color="#222222", linewidth=1, zorder=1)
        for row in best:
            place = (curves.seconds(row), curves.error(row))
            axes.scatter(*place, color=COLORS[row["method"]], s=28, zorder=2)
            axes.annotate(row["name"], place, xytext=(5, 4), textcoords="offset points", fontsize=7)

    return _svg(fill, "front", SECONDS, document)


def light_points(document: Mapping[str, Any], samples: int) -> str:
    """Error away from edges, as in soft shadows, against light points, with so many camera samples."""
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
    axes: Axes, rows: Sequence[Row], cost: Callable[[Row], float], interval: str | None, color: str
) -> None:
    across = reach([row[interval] for row in rows]) if interval else None
    axes.errorbar(
        *_places(rows, cost),
        xerr=across,
        yerr=reach([row["rmse_255"] for row in rows]),
        color=color,
        fmt="none",
        elinewidth=1,
        capsize=2,
    )


def _svg(fill: Callable[[Axes], None], name: str, across: str, document: Mapping[str, Any]) -> str:
    """Error against the quantity `across`, in logarithms, with the reference's own error and a legend."""

    def fill_figure(figure: Figure) -> None:
        axes = figure.add_subplot()
        axes.set(xscale="log", yscale="log", xlabel=across, ylabel=ERROR)
        for axis in (axes.xaxis, axes.yaxis):
            number_plainly(axis, TICKS, amount)
        fill(axes)
        own = document["reference"]["rmse_255"]
        label = f"error of the reference itself, {error(own)}"
        # A picture without noise has a reference without error, which a logarithmic axis cannot show.
        style: dict[str, Any] = {"color": "#222222", "linewidth": 1, "linestyle": "--", "label": label}
        axes.axhline(own, **style) if own > 0 else axes.plot([], **style)
        axes.grid(visible=True, which="both", alpha=0.2)
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))

    return _inline(drawn(fill_figure, FIGURE_INCHES, salt=name).decode())


def _inline(text: str) -> str:
    """The SVG element for a page, without a fixed width."""
    element = text[text.index("<svg") :]
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", element)
    )


def views(images: Sequence[NDArray[Any]], reference: Reference, display: Display) -> list[dict[str, bytes]]:
    """All pictures, and the reference last, each in three ways as PNG files.

    `whole` is the picture as displayed, `difference` its difference, `DIFFERENCE_GAIN` times enlarged
    around grey, `detail` the part where the pictures are off most, the same for all, its pixels enlarged.

    Parameters
    ----------
    images : sequence of (H, W, 3)
        Linear.
    reference : Reference
    display : Display
        The scene's.
    """
    mean = reference.mean
    squares = sum(
        (np.sum((clipped(image) - mean) ** 2, axis=2) for image in images), np.zeros(mean.shape[:2])
    )
    part = worst_part(squares, max(4, min(mean.shape[:2]) // DETAIL_PARTS))
    return [_views(image, mean, display, part) for image in (*images, mean)]


def worst_part(squares: Floats, side: int) -> tuple[slice, slice]:
    """Rows and columns of the square with that side, on a grid of half of it, that has the largest sum.

    Examples
    --------
    >>> squares = np.zeros((8, 8))
    >>> squares[5, 2] = 1
    >>> worst_part(squares, 4)
    (slice(2, 6, None), slice(0, 4, None))
    """
    height, width = squares.shape
    step = max(1, side // 2)
    corners = [
        (y, x)
        for y in range(0, max(1, height - side + 1), step)
        for x in range(0, max(1, width - side + 1), step)
    ]
    y, x = max(corners, key=lambda corner: squares[corner[0] :, corner[1] :][:side, :side].sum())
    return slice(y, y + side), slice(x, x + side)


def _views(
    image: NDArray[Any], mean: Floats, display: Display, part: tuple[slice, slice]
) -> dict[str, bytes]:
    difference = 0.5 + DIFFERENCE_GAIN * (clipped(image) - mean)
    detail = image[part]
    times = -(-MIN_DETAIL_PIXELS // max(detail.shape[:2]))
    return {
        "whole": encode_png(image, display),
        "difference": encode_png(difference, Display(transfer="linear")),
        "detail": encode_png(np.repeat(np.repeat(detail, times, axis=0), times, axis=1), display),
    }


def file_names(name: str) -> Mapping[str, str]:
    """Names of the three files of a method.

    Examples
    --------
    >>> file_names("sobol")["detail"]
    'sobol-detail.png'
    """
    return {"whole": f"{name}.png", "difference": f"{name}-difference.png", "detail": f"{name}-detail.png"}
