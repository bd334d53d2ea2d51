"""Curves of error against cost: Pareto front, order of convergence, and interpolation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from renderer.convergence import NothingToFitError, power_law
from renderer.math.intervals import Interval

MAX_ERROR_RATIO = 2.0
"""Largest ratio of an error to the nearest measured one for which a curve is interpolated."""

Row = Mapping[str, Any]
"""A setting in `results.json`."""

WORTHWHILE_RATIO = 0.95
"""Greatest ratio of errors at which the costlier setting is worth its cost: a smaller gain is hardly
seen, and may be chance."""


def seconds(row: Row) -> float:
    """CPU seconds of a setting, the median of its runs."""
    return float(row["cpu_seconds"]["estimate"])


def rays(row: Row) -> float:
    """Rays of a setting, of all kinds."""
    return float(row["rays"])


def error(row: Row) -> float:
    """Root mean square error of a setting, in units of 1/255."""
    return float(row["rmse_255"]["estimate"])


def front(rows: Sequence[Row], cost: Callable[[Row], float] = seconds) -> list[Row]:
    """The Pareto front, cheapest first: every cheaper setting has a larger error, by `WORTHWHILE_RATIO`.

    Settings whose error the reference cannot distinguish from 0 are left out.

    Examples
    --------
    >>> def row(spent, off):
    ...     return {"cpu_seconds": {"estimate": spent}, "rmse_255": {"estimate": off}, "resolved": True}
    >>> [error(kept) for kept in front([row(3, 1), row(1, 3), row(2, 4)])]
    [3.0, 1.0]
    """
    kept: list[Row] = []
    for row in sorted((row for row in rows if row["resolved"]), key=lambda row: (cost(row), error(row))):
        if not kept or error(row) <= WORTHWHILE_RATIO * error(kept[-1]):
            kept.append(row)
    return kept


def cost_at(curve: Sequence[Row], wanted_255: float, cost: Callable[[Row], float] = seconds) -> float | None:
    """The cost of an error on a curve from `front`, interpolated in logarithms between two settings.

    It is that of the first setting if the curve begins below the error; None if the curve does not reach it,
    or has no measured error within `MAX_ERROR_RATIO` of it.

    Examples
    --------
    >>> rows = [{"cpu_seconds": {"estimate": s}, "rmse_255": {"estimate": e}} for s, e in ((1, 4), (16, 1))]
    >>> cost_at(rows, 2.0), cost_at(rows, 0.5), cost_at(rows, 5.0)
    (4.0, None, 1.0)
    >>> rows[1]["rmse_255"]["estimate"] = 0.1
    >>> cost_at(rows, 1.0) is None
    True
    """
    if curve and error(curve[0]) <= wanted_255:
        return cost(curve[0])
    for coarse, fine in pairwise(curve):
        if error(coarse) >= wanted_255 >= error(fine):
            if not _near(coarse, fine, wanted_255):
                return None
            share = math.log(error(coarse) / wanted_255) / math.log(error(coarse) / error(fine))
            return cost(coarse) * (cost(fine) / cost(coarse)) ** share
    return None


def error_at(curve: Sequence[Row], spent: float) -> float | None:
    """The error, in units of 1/255, that a curve has after so many seconds.

    None outside of the curve, and without a measured error within `MAX_ERROR_RATIO`.

    Examples
    --------
    >>> rows = [{"cpu_seconds": {"estimate": s}, "rmse_255": {"estimate": e}} for s, e in ((1, 4), (16, 1))]
    >>> error_at(rows, 4.0), error_at(rows, 17.0)
    (2.0, None)
    """
    for coarse, fine in pairwise(curve):
        if seconds(coarse) <= spent <= seconds(fine):
            share = math.log(spent / seconds(coarse)) / math.log(seconds(fine) / seconds(coarse))
            found = error(coarse) * (error(fine) / error(coarse)) ** share
            return found if _near(coarse, fine, found) else None
    return None


def _near(coarse: Row, fine: Row, wanted_255: float) -> bool:
    # A hundredth more, since settings with errors four times apart by design differ from that by noise.
    return min(error(coarse) / wanted_255, wanted_255 / error(fine)) <= 1.01 * MAX_ERROR_RATIO


def order(curve: Sequence[Row], cost: Callable[[Row], float] = seconds) -> Interval | None:
    """The power p in error = C cost^p, by least squares in logarithms; None for less than three settings."""
    try:
        return power_law([cost(row) for row in curve], [error(row) for row in curve]).order
    except NothingToFitError:
        return None


def halving(power: Interval) -> Interval | None:
    """The factor of cost for half the error, if the error falls with that power of the cost.

    None if the error does not fall; without an upper end if it may not fall.

    Examples
    --------
    >>> halving(Interval(-0.5, -1.0, 0.1))
    Interval(estimate=4.0, low=2.0, high=inf)
    """
    estimate, low, high = (_times(value) for value in (power.estimate, power.low, power.high))
    return None if max(estimate, low) == math.inf else Interval(estimate, low, high)


def _times(power: float) -> float:
    # Beyond 2^1000 a float overflows.
    return 2 ** (-1 / power) if power < -1e-3 else math.inf
