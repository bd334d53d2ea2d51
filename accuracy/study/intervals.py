"""Means of several runs, with the interval that holds the true one in 95 of 100 cases."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING

from renderer.convergence import Interval, student

if TYPE_CHECKING:
    from collections.abc import Sequence


def half_width(values: Sequence[float]) -> float:
    """Half of the interval of the mean of two values or more that are normal and independent.

    Examples
    --------
    >>> round(half_width([1.0, 2.0, 3.0]), 3)
    2.484
    """
    return student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))


def mean(values: Sequence[float]) -> Interval:
    """The mean of values; one value alone tells nothing of its interval, which is then without width."""
    middle = statistics.fmean(values)
    half = half_width(values) if len(values) > 1 else 0.0
    return Interval(middle, middle - half, middle + half)


def middle(values: Sequence[float]) -> Interval:
    """The median, and the least and the greatest: how measured seconds are told."""
    return Interval(statistics.median(values), min(values), max(values))
