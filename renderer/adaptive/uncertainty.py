"""How far the picture is from the converged one, and how sure that is."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from schemas.quality import CONFIDENCE

INTERVAL = 1.96
"""Standard errors to either side of an interval that holds in 95 of 100 cases."""


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """Root mean square error of the linear picture clipped to 0..1, over pixels and channels.

    Attributes
    ----------
    estimate : float
    low, high : float
        An interval that holds the true one in 95 of 100 pictures.
    bound : float
        What the true one is below in the share of pictures that was asked for, by default 95 of 100.
    """

    estimate: float
    low: float
    high: float
    bound: float

    def document(self) -> dict[str, float]:
        """As results tell it."""
        return {"estimate": self.estimate, "low": self.low, "high": self.high}


def standard_errors(confidence: float) -> float:
    """How many of them lie between an estimate and what the true value is below in a share of all cases.

    Numbers whose errors are normal are below their estimate in half of all cases.
    """
    return NormalDist().inv_cdf(confidence)


def error_of(total: float, variance: float, pixels: int, confidence: float = CONFIDENCE) -> ErrorEstimate:
    """The error of a picture, from the estimated sum of its pixels' squared errors and its variance.

    Only the bound depends on the `confidence`, the share of pictures that it is to hold in.
    """

    def root(squares: float) -> float:
        return float(np.sqrt(max(squares, 0.0) / pixels))

    deviation = float(np.sqrt(variance))
    return ErrorEstimate(
        estimate=root(total),
        low=root(total - INTERVAL * deviation),
        high=root(total + INTERVAL * deviation),
        bound=root(total + standard_errors(confidence) * deviation),
    )
