"""Reproducible plots as SVG or PNG, and logarithmic axes with plain numbers."""

from __future__ import annotations

import io
import threading
from typing import TYPE_CHECKING, Any

from renderer.errors import MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

BLUE, CYAN, RED, YELLOW, GREEN, PURPLE = "#4477aa", "#66ccee", "#ee6677", "#ccbb44", "#228833", "#aa3377"
"""Paul Tol's bright scheme, which people with any colour vision can distinguish."""

DOTS_PER_INCH = 150
"""Of a PNG, an inch."""

# Settings of the library belong to the process, and threads of a server draw at the same time.
_drawing = threading.Lock()


def require_matplotlib() -> None:
    """Check that plots can be drawn.

    Raises
    ------
    MissingExtraError
        If the library that draws them is not installed.
    """
    try:
        import matplotlib as mpl  # noqa: F401, PLC0415  an extra that many installations do without
    except ImportError as error:
        raise MissingExtraError(
            "Plots need the package matplotlib. Install it with: pip install 'penumbra-render[study]'"
        ) from error


def drawn(
    fill: Callable[[Figure], None],
    size: tuple[float, float],
    *,
    form: str = "svg",
    font_size: float = 9,
    salt: str = "penumbra",
) -> bytes:
    """Draw a figure.

    Parameters
    ----------
    fill : callable
        Draws on the empty figure.
    size : pair of float
        Inches.
    form : str
        "svg", whose text stays text, or "png".
    font_size : float
        Points.
    salt : str
        Makes the names in an SVG differ from those of others on the same page.

    Raises
    ------
    MissingExtraError
        See `require_matplotlib`.
    """
    require_matplotlib()
    import matplotlib as mpl  # noqa: PLC0415  see above
    from matplotlib.figure import Figure  # noqa: PLC0415

    style: dict[Any, Any] = {"svg.hashsalt": salt, "svg.fonttype": "none", "font.size": font_size}
    file = io.BytesIO()
    with _drawing, mpl.rc_context(style):
        figure = Figure(figsize=size, layout="constrained")
        fill(figure)
        metadata = {"Date": None} if form == "svg" else {"Software": None}
        figure.savefig(file, format=form, dpi=DOTS_PER_INCH, metadata=metadata)
    return file.getvalue()


def number_plainly(axis: Axis, steps: Sequence[float], write: Callable[[float], str] = "{:g}".format) -> None:
    """Write numbers without powers at these multiples of every power of ten of a logarithmic axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: PLC0415  see above

    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: write(value)))
    axis.set_minor_formatter(NullFormatter())


def reach(intervals: Sequence[Mapping[str, float]]) -> list[list[float]]:
    """Lengths of intervals below and above their estimates, as error bars are drawn."""
    return [
        [max(0.0, one["estimate"] - one["low"]) for one in intervals],
        [max(0.0, one["high"] - one["estimate"]) for one in intervals],
    ]
