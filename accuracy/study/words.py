"""Numbers as text: errors, times, amounts, intervals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


def figure(value: float, digits: int = 2) -> str:
    """A number with so many significant digits and without an exponent.

    Examples
    --------
    >>> [figure(value) for value in (0.04567, 1.0, 12.34, 4321.0, 0.0)]
    ['0.046', '1.0', '12', '4300', '0']
    """
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, decimals):.{max(0, decimals)}f}"


def amount(value: float) -> str:
    """A round number, short.

    Examples
    --------
    >>> [amount(value) for value in (0.05, 2.0, 5000.0, 2e7)]
    ['0.05', '2', '5000', '20 M']
    """
    return f"{value / 1e6:g} M" if value >= 1e6 else f"{value:g}"


def error(value_255: float) -> str:
    """An error in units of 1/255.

    Examples
    --------
    >>> error(0.5), error(2.0), error(0.8765)
    ('0.5/255', '2/255', '0.88/255')
    """
    return f"{value_255:g}/255" if value_255 in {0.25, 0.5, 1, 2, 4, 8, 16} else f"{figure(value_255)}/255"


def seconds(value: float) -> str:
    """A time.

    Examples
    --------
    >>> seconds(0.456), seconds(75.0), seconds(3660.0)
    ('0.46 s', '1 min 15 s', '1 h 1 min')
    """
    if value < 60:
        return f"{figure(value)} s"
    minutes, rest = divmod(round(value), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def interval(value: Mapping[str, Any], digits: int = 3) -> str:
    """A value with the ends of its interval, if that has any width.

    Examples
    --------
    >>> interval({"estimate": 2.0, "low": 1.0, "high": None})
    '2.00 (1.00 or more)'
    >>> interval({"estimate": 2.0, "low": 2.0, "high": 2.0})
    '2.00'
    """
    middle, low = figure(value["estimate"], digits), figure(value["low"], digits)
    if value["high"] is None:
        return f"{middle} ({low} or more)"
    high = figure(value["high"], digits)
    return middle if low == middle == high else f"{middle} ({low} to {high})"
