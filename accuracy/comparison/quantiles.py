"""Limits of Student's and the normal distribution, without a table."""

import math
from statistics import NormalDist

import numpy as np

from renderer.math.arrays import Floats


def shared_out(probability: float, tests: int) -> float:
    """The level of each of so many independent tests, for one false alarm with `probability` (Sidak 1967).

    >>> round(shared_out(0.05, 1), 9), round(shared_out(0.05, 10), 6)
    (0.05, 0.005116)
    """
    return -math.expm1(math.log1p(-probability) / tests)


def beyond(t: float, freedom: int) -> float:
    """Probability that |T| exceeds t > 0 for Student's T with so many degrees of freedom (A&S 26.7.3-4).

    The series is one of products: error below 2 eps for each degree of freedom.

    >>> round(beyond(12.706204736, 1), 9), round(beyond(2.228138852, 10), 9)
    (0.05, 0.05)
    """
    angle = math.atan(t / math.sqrt(freedom))
    square = freedom / (freedom + t * t)
    odd = freedom % 2
    term, total = (math.sqrt(square) if odd else 1.0), 0.0
    for order in range(2 + odd, freedom + 1, 2):
        total += term
        term *= square * (order - 1) / order
    within = t / math.sqrt(freedom + t * t) * total
    return 1 - (2 / math.pi * (angle + within) if odd else within)


def student_limit(probability: float, freedom: int) -> float:
    """The t that |T| exceeds with this probability, to 12 digits, by bisection."""
    low, high = 0.0, 1.0
    while beyond(high, freedom) > probability:
        high *= 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if beyond(middle, freedom) > probability else (low, middle)
    return high


def normal_limit(probability: float) -> float:
    """The z that |Z| exceeds with this probability."""
    return -NormalDist().inv_cdf(probability / 2)


def normal_equivalent(t: Floats, freedom: Floats) -> Floats:
    """The z that is as rare as each t >= 0 (Wallace 1959); within 3 % from 3 degrees of freedom on.

    Large t of few degrees of freedom are not rare; infinite freedom gives back t but for rounding.
    """
    bounded = np.minimum(freedom, 1e9)
    shrunk = np.sqrt(bounded * np.log1p(t * t / bounded))
    return shrunk * (8 * bounded + 1) / (8 * bounded + 3)
