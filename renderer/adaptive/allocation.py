"""Which pixel gets how many samples, so that the error wished for costs the least.

The squared error of a pixel whose single samples have variance c goes like c n**-1.5 with n samples of a
Sobol sequence: most of it comes from edges. The sum over pixels is wanted at the least sum of n, which
Lagrange's multiplier gives: n = (1.5 c m)**0.4 for a price of 1 / m a sample.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.levels import COUNTS, levels_of
from renderer.adaptive.strata import Survey
from renderer.arrays import Floats, Integers

BINS = 256
"""Of the logarithm of variances, four an octave, for the search of the multiplier."""


@dataclass(frozen=True, slots=True, eq=False)
class Allocation:
    """Levels that are wanted.

    Attributes
    ----------
    pixels : (n,) int64
        Of the sampled pixels.
    strata : (K,) int64
        Of all pixels of a stratum, 0 where their first look is good enough.
    """

    pixels: Integers
    strata: Integers


def allocate(variances: Floats, levels: NDArray[np.uint8], survey: Survey, goal: float) -> Allocation:
    """Distribute samples so that the sum of squared errors becomes `goal`, as far as can be told now.

    Parameters
    ----------
    variances : (n,) float64
        Of single samples of the pixels that are sampled, so that they times n**-1.5 are squared errors.
    levels : (n,) uint8
        That they have; none gets fewer samples than it has.
    survey : Survey
        Of the pixels whose first look is shown.
    goal : float
    """
    bins = np.clip(np.log2(np.maximum(variances, 1e-15)) * 4 + 200, 0, BINS - 1).astype(np.int64)
    sorts = np.bincount(bins * 32 + levels, minlength=BINS * 32)
    used = np.flatnonzero(sorts)
    typical, have, many = 2.0 ** ((used // 32 - 199.5) / 4), used % 32, sorts[used]

    def left(multiplier: float) -> float:
        wanted = np.maximum(_levels(typical, multiplier), have)
        sampled = (many * typical * COUNTS[wanted] ** -1.5).sum()
        return float(sampled + (survey.sizes * _looked(survey, multiplier)[1]).sum())

    multiplier = _least(left, goal)
    return Allocation(
        pixels=np.maximum(_levels(variances, multiplier), levels), strata=_looked(survey, multiplier)[0]
    )


def _levels(variances: Floats, multiplier: float) -> Integers:
    return levels_of((1.5 * variances * multiplier) ** 0.4)


def _looked(survey: Survey, multiplier: float) -> tuple[Integers, Floats]:
    """Levels of the strata, and the squared error that a pixel of them is left with.

    A first look stays where samples would not pay. Its probes must be sure of its error by two standard
    errors: to sample a whole stratum is never taken back.
    """
    levels = _levels(survey.variances, multiplier)
    kept = np.maximum(survey.errors - 2 * survey.uncertain, 0)
    sampled = survey.variances * COUNTS[levels] ** -1.5
    pays = sampled + COUNTS[levels] / multiplier < kept
    return levels * pays, sampled * pays + kept * ~pays


def _least(left: Callable[[float], float], goal: float) -> float:
    """The least multiplier, within a twentieth, that leaves no more than `goal`."""
    low, high = 1e-2, 1e14
    while high > 1.05 * low:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if left(middle) > goal else (low, middle)
    return float(high)
