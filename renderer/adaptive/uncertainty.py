"""Estimated error of a picture, with its 95 % interval and the bound that has to keep the target."""

from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from statistics import NormalDist
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.labels import Labels, of_labels
from renderer.math.arrays import Floats, Integers
from schemas.quality import CONFIDENCE

INTERVAL = 1.96
"""Standard errors to either side of a normal 95 % interval."""


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """Root mean square error of the linear picture clipped to 0..1, over pixels and channels.

    Attributes
    ----------
    estimate : float
    low, high : float
        A 95 % interval.
    bound : float
        An upper bound on the true error with the requested confidence, by default 95 %.
    """

    estimate: float
    low: float
    high: float
    bound: float

    @classmethod
    def restored(cls, array: NDArray[Any]) -> Self:
        """Restore an error from its `array`.

        Raises
        ------
        ValueError
            If the array does not name just these numbers.
        """
        if array.dtype != _NUMBERS:
            raise ValueError(f"These are not the numbers of an error: {array.dtype} is not {_NUMBERS}.")
        return cls(**dict(zip(array.dtype.names or (), array.item(), strict=True)))

    def array(self) -> NDArray[Any]:
        """Its fields as a structured scalar array, float64."""
        return np.array(astuple(self), dtype=_NUMBERS)

    def document(self) -> dict[str, float]:
        """The error as results report it."""
        return {"estimate": self.estimate, "low": self.low, "high": self.high}


_NUMBERS = np.dtype([(item.name, np.float64) for item in fields(ErrorEstimate)])


def standard_errors(confidence: float) -> float:
    """Standard errors from an estimate to an upper bound with a confidence, for normal errors."""
    return NormalDist().inv_cdf(confidence)


POISSON_95 = 3.0
"""Expected number of events of which at least one occurs in 95 % of all cases (Poisson)."""


def unseen_glints(labels: Labels, counts: Callable[[], Integers], brightness: Floats) -> float:
    """Sum of squared errors that reflections of lights may add though no ray has hit them.

    A reflection that fills a share 3 / n of the pixels is missed by all of n rays in one case of 20. A light
    B times as bright as white makes at most B times as many pixels wrong as it fills, by 1 each.

    Parameters
    ----------
    labels : (H, W) int32
    counts : callable
        Returns the rays through each pixel, (H, W) int64; not called without such lights.
    brightness : (shapes,) float64
        Of the brightest visible light as each shape reflects or transmits it, 0 if not above white.
    """
    if not brightness.any():
        return 0.0
    shown = of_labels(brightness > 0, labels)
    rays = max(int(counts()[shown].sum()), 1)
    return min(1.0, POISSON_95 * float(brightness.max()) / rays) * int(np.count_nonzero(shown))


def error_of(
    total: float, variance: float, pixels: int, confidence: float = CONFIDENCE, unseen: float = 0.0
) -> ErrorEstimate:
    """The error of a picture, from the estimated sum of its pixels' squared errors and its variance.

    Only the bound depends on the `confidence`. `unseen` errors count at the upper end of the interval alone.
    """

    def root(squares: float) -> float:
        return float(np.sqrt(max(squares, 0.0) / pixels))

    deviation = float(np.sqrt(variance))
    return ErrorEstimate(
        estimate=root(total),
        low=root(total - INTERVAL * deviation),
        high=root(total + INTERVAL * deviation + unseen),
        bound=root(total + standard_errors(confidence) * deviation),
    )
