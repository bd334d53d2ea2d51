"""Estimates with 95 % intervals, and Student's t."""

from dataclasses import dataclass
from functools import cache
from math import atan, exp, hypot, inf, isfinite, log, pi, sqrt
from statistics import NormalDist

INTERVAL_CONFIDENCE = 0.95
"""Probability that an interval contains the true value."""

INTERVAL_DEVIATIONS = NormalDist().inv_cdf((1 + INTERVAL_CONFIDENCE) / 2)
"""Half width of such an interval, standard deviations."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate, and the ends of its 95 % interval.

    Attributes
    ----------
    estimate, low, high : float
        ``low <= estimate <= high``; `high` is inf where nothing bounds the value. Products, multiples and
        roots are those of quantities that are not below 0.
    """

    estimate: float
    low: float
    high: float

    def scaled(self, factor: float) -> "Interval":
        """A multiple, `factor` >= 0."""
        return Interval(self.estimate * factor, self.low * factor, self.high * factor)

    def times(self, other: "Interval") -> "Interval":
        """The product of quantities that err independently: relative deviations add in squares.

        >>> Interval(2.0, 1.0, 4.0).times(Interval(3.0, 3.0, 3.0))
        Interval(estimate=6.0, low=3.0, high=12.0)
        """
        estimate = self.estimate * other.estimate
        down = hypot(_log_ratio(self.estimate, self.low), _log_ratio(other.estimate, other.low))
        up = hypot(_log_ratio(self.high, self.estimate), _log_ratio(other.high, other.estimate))
        return Interval(estimate, estimate * exp(-down), estimate * exp(up) if estimate else 0.0)

    def root(self) -> "Interval":
        """The square root."""
        return Interval(sqrt(self.estimate), sqrt(self.low), sqrt(self.high))

    def document(self) -> dict[str, float | None]:
        """For JSON, which has no infinity: `high` is None if nothing bounds the value."""
        high = self.high if isfinite(self.high) else None
        return {"estimate": self.estimate, "low": self.low, "high": high}


def _log_ratio(larger: float, smaller: float) -> float:
    """Logarithm of a ratio of at least 1."""
    if larger == smaller:
        return 0.0
    return log(larger / smaller) if smaller > 0 else inf


def beyond(t: float, freedom: int) -> float:
    """Probability that |T| exceeds t > 0 for Student's T with these degrees of freedom (A&S 26.7.3-4).

    The series is one of products: error below 2 eps for each degree of freedom.

    >>> round(beyond(12.706204736, 1), 9), round(beyond(2.228138852, 10), 9)
    (0.05, 0.05)
    """
    angle = atan(t / sqrt(freedom))
    square = freedom / (freedom + t * t)
    odd = freedom % 2
    term, total = (sqrt(square) if odd else 1.0), 0.0
    for order in range(2 + odd, freedom + 1, 2):
        total += term
        term *= square * (order - 1) / order
    within = t / sqrt(freedom + t * t) * total
    return 1 - (2 / pi * (angle + within) if odd else within)


@cache
def student(freedom: int, probability: float = 1 - INTERVAL_CONFIDENCE) -> float:
    """The t that |T| exceeds with this probability, for so many degrees of freedom, to 12 digits.

    By default half the width of a 95 % interval, in standard errors.

    >>> [round(student(freedom), 3) for freedom in (1, 2, 3, 30)]
    [12.706, 4.303, 3.182, 2.042]
    """
    low, high = 0.0, 1.0
    while beyond(high, freedom) > probability:
        high *= 2
    # Each step halves the interval: more of them than a float has bits change nothing.
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if beyond(middle, freedom) > probability else (low, middle)
    return high
