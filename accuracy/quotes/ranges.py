"""Predictions with their intervals, and the statistics of samples that are spread over a picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, hypot, inf, log, sqrt

import numpy as np
import numpy.typing as npt

from renderer.convergence import NORMAL, student
from renderer.math.arrays import Floats

BELIEVED = 4
"""How many degrees of freedom the usual deviation counts for: of two or three samples, the deviation is
chance."""


@dataclass(frozen=True, slots=True)
class Range:
    """A positive quantity, and an interval that holds it in 95 of 100 cases.

    Attributes
    ----------
    estimate, low, high : float
        ``0 <= low <= estimate <= high``.
    """

    estimate: float
    low: float
    high: float

    def scaled(self, factor: float) -> "Range":
        """The same of a multiple, `factor` >= 0."""
        return Range(self.estimate * factor, self.low * factor, self.high * factor)

    def plus(self, other: "Range") -> "Range":
        """The sum of quantities that may err together."""
        return Range(self.estimate + other.estimate, self.low + other.low, self.high + other.high)

    def times(self, other: "Range") -> "Range":
        """The product of quantities that err independently: relative deviations add in squares.

        >>> Range(2.0, 1.0, 4.0).times(Range(3.0, 3.0, 3.0))
        Range(estimate=6.0, low=3.0, high=12.0)
        """
        estimate = self.estimate * other.estimate
        down = hypot(_ratio(self.estimate, self.low), _ratio(other.estimate, other.low))
        up = hypot(_ratio(self.high, self.estimate), _ratio(other.high, other.estimate))
        return Range(estimate, estimate * exp(-down), estimate * exp(up) if estimate else 0.0)

    def root(self) -> "Range":
        """The square root."""
        return Range(sqrt(self.estimate), sqrt(self.low), sqrt(self.high))


def _ratio(larger: float, smaller: float) -> float:
    """Logarithm of a ratio of at least 1."""
    if larger == smaller:
        return 0.0
    return log(larger / smaller) if smaller > 0 else inf


def factor(deviation: float) -> Range:
    """A factor of about 1 whose logarithm is normal with this standard deviation."""
    width = exp(NORMAL * deviation)
    return Range(1.0, 1 / width, width)


def mean(values: npt.ArrayLike, usual: float, covered: float = 0.0) -> Range:
    """The mean of a population from samples of it.

    Parameters
    ----------
    values : (n,) array_like
        Independent samples, or such that lie more evenly than independent ones.
    usual : float
        Standard deviation that such samples usually have, relative to their mean. Few samples are believed
        less than this, many more.
    covered : float
        Share of the population that they are: nothing is left to be unsure of where it is 1.

    Returns
    -------
    Range
        By Student's t. It holds as often as it says where the deviation is at most the usual one or the
        samples are many.
    """
    values = np.asarray(values, dtype=np.float64)
    middle = max(float(values.mean()), 0.0)
    return _around(middle, values - values.mean(), usual * middle, max(1 - covered, 0.0))


def ratio(parts: npt.ArrayLike, wholes: npt.ArrayLike, usual: float) -> Range:
    """The ratio of two means from pairs of samples (n,), as in Cochran, Sampling Techniques, chapter 6.

    `usual` is the deviation of the ratio of a pair, relative to the ratio.
    """
    parts, wholes = np.asarray(parts, dtype=np.float64), np.asarray(wholes, dtype=np.float64)
    middle = float(parts.mean() / wholes.mean())
    return _around(middle, (parts - middle * wholes) / wholes.mean(), usual * middle, 1.0)


def _around(middle: float, residuals: Floats, usual: float, left: float) -> Range:
    freedom = residuals.size - 1 + BELIEVED
    variance = (float(np.sum(residuals**2)) + BELIEVED * usual**2) / freedom
    half = student(freedom) * sqrt(variance / residuals.size * left)
    return Range(middle, max(middle - half, 0.0), middle + half)


def line(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Slope and scatter of the straight line that is nearest to points, by least squares."""
    across, up = np.asarray(x) - np.mean(x), np.asarray(y) - np.mean(y)
    slope = float(across @ up / (across @ across))
    return slope, float(np.sqrt(np.mean((up - slope * across) ** 2)))
