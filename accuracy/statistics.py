"""Statistics: means and medians with 95 % intervals, and levels of tests."""

import statistics
from collections.abc import Sequence
from math import exp, expm1, log1p, sqrt

import numpy as np
import numpy.typing as npt

from renderer.math.arrays import Floats
from renderer.math.intervals import INTERVAL_DEVIATIONS, Interval, student

USUAL_DEGREES = 4
"""Degrees of freedom of the usual deviation: the deviation of two or three samples alone is mostly chance."""


def half_width(values: Sequence[float]) -> float:
    """Half width of the interval of the mean of two or more independent normal values.

    Examples
    --------
    >>> round(half_width([1.0, 2.0, 3.0]), 3)
    2.484
    """
    return student(len(values) - 1) * statistics.stdev(values) / sqrt(len(values))


def median(values: Sequence[float]) -> Interval:
    """The median with the least and the greatest value, as measured seconds are reported."""
    return Interval(statistics.median(values), min(values), max(values))


def factor(deviation: float) -> Interval:
    """A factor of about 1 whose logarithm is normal with this standard deviation."""
    width = exp(INTERVAL_DEVIATIONS * deviation)
    return Interval(1.0, 1 / width, width)


def mean(values: npt.ArrayLike, usual: float, covered: float = 0.0) -> Interval:
    """The mean of a population from samples of it.

    Parameters
    ----------
    values : (n,) array_like
        Independent samples, or more evenly distributed ones.
    usual : float
        Usual standard deviation of such samples, relative to their mean. It outweighs few samples, but not
        many.
    covered : float
        Sampled share of the population: at 1 the mean is exact.

    Returns
    -------
    Interval
        By Student's t. Its coverage is right if the deviation is at most the usual one, or with many samples.
    """
    values = np.asarray(values, dtype=np.float64)
    middle = max(float(values.mean()), 0.0)
    freedom = values.size - 1 + USUAL_DEGREES
    variance = (
        float(np.sum((values - values.mean()) ** 2)) + USUAL_DEGREES * (usual * middle) ** 2
    ) / freedom
    half = student(freedom) * sqrt(variance / values.size * max(1 - covered, 0.0))
    return Interval(middle, max(middle - half, 0.0), middle + half)


def shared_out(probability: float, tests: int) -> float:
    """The level of each of `tests` independent tests, for a false alarm with `probability` (Sidak 1967).

    >>> round(shared_out(0.05, 1), 9), round(shared_out(0.05, 10), 6)
    (0.05, 0.005116)
    """
    return -expm1(log1p(-probability) / tests)


def normal_limit(probability: float) -> float:
    """The z that |Z| exceeds with this probability."""
    return -statistics.NormalDist().inv_cdf(probability / 2)


def normal_equivalent(t: Floats, freedom: Floats) -> Floats:
    """The normal z that is as rare as each t >= 0 (Wallace 1959).

    It is within 3 % for 3 or more degrees of freedom. With few degrees of freedom a large t is not rare; with
    infinitely many z is t up to rounding.
    """
    bounded = np.minimum(freedom, 1e9)
    shrunk = np.sqrt(bounded * np.log1p(t * t / bounded))
    return shrunk * (8 * bounded + 1) / (8 * bounded + 3)


def clipped(image: npt.ArrayLike) -> Floats:
    """Linear values clipped for errors, float64 in 0..1."""
    return np.clip(np.asarray(image, dtype=np.float64), 0.0, 1.0)


def rms_difference(image: npt.ArrayLike, other: npt.ArrayLike) -> float:
    """Root mean square difference of two pictures of linear values clipped to 0..1.

    Examples
    --------
    >>> rms_difference(np.array([0.0, 3.0]), np.array([0.5, 1.0]))
    0.3535533905932738
    """
    return float(np.sqrt(np.mean((clipped(image) - clipped(other)) ** 2)))
