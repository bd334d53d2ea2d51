"""Rate of convergence of a picture: a power law fitted to its passes, and the cost of half the error.

The error after the time t is modelled as C t^p. In logarithms that is a line, fitted by least squares, with
each pass weighted by its own interval (Bevington and Robinson, Data Reduction and Error
Analysis for the Physical Sciences, chapter 6).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from renderer.math.arrays import Floats
from renderer.math.intervals import INTERVAL_DEVIATIONS, Interval, student

MIN_FIT_POINTS = 3
"""Points that a fit needs: through two points a line always fits, so that its error would be unknown."""

CLOCKS = ("seconds", "cpu_seconds")
"""The times that a pass reports."""


class NothingToFitError(ValueError):
    """No law can be fitted to these points; the message says why."""


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """The error as a power of the time.

    Attributes
    ----------
    order : Interval
        The power, dimensionless; below 0 where the error falls.
    time, error : float
        A point of the fitted line, in the middle of the points.
    margin : float
        Half the interval of the logarithm of the error at the most certain point.
    squares : float
        Sum of the squared distances of the points from the middle, in logarithms of times and by weight.
    newest, weight : float
        Distance of the latest point from the middle, and its weight; that of the most certain point is 1.
    """

    order: Interval
    time: float
    error: float
    margin: float
    squares: float
    newest: float
    weight: float

    def at(self, times: npt.ArrayLike) -> Floats:
        """Errors (N,) after `times` (N,)."""
        errors: Floats = self.error * (np.asarray(times, dtype=np.float64) / self.time) ** self.order.estimate
        return errors

    def falling(self, spent: float, factor: float = 2.0) -> Interval | None:
        """Cost beyond `spent`, in its unit, of dividing the newest error by `factor`.

        The interval contains the time at which a pass will report that error in at least 95 of 100 cases, if
        that of the order is right: it includes the scatter of passes about the line (Fieller 1954, Some
        Problems in Interval Estimation). It has no upper end if the error may not fall; None if it does not.
        """
        steep, wanted = -self.order.estimate, float(np.log(factor))
        if steep <= 0:
            return None
        # The logarithm of the time grows by d, where (steep d - wanted)^2 is at most the square of the margin
        # times 2 / weight + (d^2 + 2 d newest) / squares.
        doubt = self.margin**2 / self.squares
        square = steep**2 - doubt
        linear = steep * wanted + doubt * self.newest
        constant = wanted**2 - 2 * self.margin**2 / self.weight
        root = float(np.sqrt(max(linear**2 - square * constant, 0.0)))
        estimate = _longer(spent, wanted / steep)
        low = _longer(spent, max(constant, 0.0) / (linear + root))
        if max(low, estimate) == inf:
            return None
        return Interval(estimate, low, _longer(spent, (linear + root) / square) if square > 0 else inf)


def power_law(times: npt.ArrayLike, errors: npt.ArrayLike, highs: npt.ArrayLike | None = None) -> PowerLaw:
    """Fit a power law.

    The interval of its order holds in at least 95 of 100 cases where the logarithms of the errors are off by
    independent normal deviations, either as large as `highs` say or all larger or smaller by one factor: it
    is the wider one of what the intervals and what the scatter about the line (Student's t) say.

    Parameters
    ----------
    times, errors : (N,) array_like
        In any unit. Points that have no logarithm are left out.
    highs : (N,) array_like, optional
        Upper ends of the errors' intervals of 95 in 100, which are symmetric in the squares of the errors.
        Without them, or where one is not above its error, all points weigh the same and only scatter counts.

    Raises
    ------
    NothingToFitError
        If less than three points are left, or all are of the same time.
    """
    times, errors = np.asarray(times, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    usable = np.isfinite(times) & (times > 0) & np.isfinite(errors) & (errors > 0)
    count = np.count_nonzero(usable)
    if count < MIN_FIT_POINTS:
        raise NothingToFitError(
            f"A fit needs {MIN_FIT_POINTS} passes with an error above 0, and there are {count}."
        )
    x, y = np.log(times[usable]), np.log(errors[usable])
    deviations = _deviations(errors, highs)[usable]
    if not (np.isfinite(deviations) & (deviations > 0)).all():
        return _line(x, y, np.ones(x.size), 0.0)
    least = float(deviations.min())
    return _line(x, y, (least / deviations) ** 2, least)


def trend(passes: Sequence[Mapping[str, Any]], unknown: str | None = None) -> dict[str, Any]:
    """Estimate the convergence of a picture from its passes.

    Parameters
    ----------
    passes : sequence of mappings
        `seconds`, `cpu_seconds` and `error` when each pass ended, as reports have them.
    unknown : str, optional
        Why there are no errors, if there are none.

    Returns
    -------
    dict
        `order`: the power of CPU seconds like which the error falls, with its interval. `next_halving`:
        what half of the newest error would cost beyond what was spent for that, in `seconds` and
        `cpu_seconds`, at the rate at which CPU seconds were spent so far. Either may be None, or the latter
        without an upper end; `reason` then says why.
    """
    known = [entry for entry in passes if entry["error"] is not None]
    try:
        if not known and unknown:
            raise NothingToFitError(unknown)
        law = law_of(known)
    except NothingToFitError as error:
        return {"order": None, "next_halving": None, "reason": str(error)}
    costs = {clock: law.falling(known[-1][clock]) for clock in CLOCKS}
    documents = {clock: cost.document() for clock, cost in costs.items() if cost}
    return {"order": law.order.document(), "next_halving": documents or None, "reason": _doubt(costs)}


def _doubt(costs: Mapping[str, Interval | None]) -> str | None:
    if not all(costs.values()):
        return "The error does not fall from pass to pass."
    if any(cost and cost.high == inf for cost in costs.values()):
        return "The passes are too few, or too far from a power law, to show how fast the error falls."
    return None


def law_of(passes: Sequence[Mapping[str, Any]]) -> PowerLaw:
    """The law in CPU seconds of passes all of which have an error.

    Raises
    ------
    NothingToFitError
        See `power_law`.
    """
    errors = [entry["error"] for entry in passes]
    return power_law(
        [entry["cpu_seconds"] for entry in passes],
        [error["estimate"] for error in errors],
        [error["high"] for error in errors],
    )


def _deviations(errors: Floats, highs: npt.ArrayLike | None) -> Floats:
    """Standard deviations of the logarithms of errors: half of those of the squares, relative to these."""
    if highs is None:
        return np.zeros(errors.size)
    with np.errstate(all="ignore"):
        deviations: Floats = ((np.asarray(highs, dtype=np.float64) / errors) ** 2 - 1) / (
            2 * INTERVAL_DEVIATIONS
        )
    return deviations


def _line(x: Floats, y: Floats, weights: Floats, deviation: float) -> PowerLaw:
    """The line through points whose standard deviations are `deviation` over the roots of `weights`."""
    if x.min() == x.max():
        raise NothingToFitError("All errors were measured at the same time.")
    total = weights.sum()
    middle, height = (weights * x).sum() / total, (weights * y).sum() / total
    across, up = x - middle, y - height
    squares = (weights * across**2).sum()
    order = float((weights * across * up).sum() / squares)
    freedom = x.size - 2
    scatter = np.sqrt((weights * (up - order * across) ** 2).sum() / freedom)
    latest = int(np.argmax(x))
    margin = float(max(INTERVAL_DEVIATIONS * deviation, student(freedom) * scatter))
    half = margin / float(np.sqrt(squares))
    return PowerLaw(
        order=Interval(order, order - half, order + half),
        time=float(np.exp(middle)),
        error=float(np.exp(height)),
        margin=margin,
        squares=float(squares),
        newest=float(across[latest]),
        weight=float(weights[latest]),
    )


def _longer(spent: float, growth: float) -> float:
    """Increase of `spent` when its logarithm grows by an amount; inf on overflow."""
    with np.errstate(over="ignore"):
        return float(spent * np.expm1(growth))
