"""Which pixel gets how many samples, so that the target error costs the least.

The squared error of a pixel whose single samples have variance c is proportional to c n**-1.5 with n samples
of a Sobol sequence: most of it comes from edges. The same holds for n rays of lattices that find what a pixel
at a border shows, which cost less. The cheapest distribution with a given sum of squared errors follows from
a Lagrange multiplier m: n = (1.5 c m / p)**0.4 for a price p of a sample.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.levels import COUNTS, COVERAGES, RAY_PRICE, levels_of
from renderer.adaptive.strata import Survey
from renderer.math.arrays import Floats, Integers

BINS = 256
"""Bins of the logarithm of variances, four per octave, in the search for the multiplier."""

_COVERED = np.maximum(COVERAGES, 1)
"""Samples that a coverage is worth: where there is none, the pilot sample is one."""


@dataclass(frozen=True, slots=True, eq=False)
class Allocation:
    """Levels to bring pixels to.

    Attributes
    ----------
    pixels : (n,) int64
        Of the sampled pixels.
    strata : (K,) int64
        Of all pixels of a stratum, 0 where their pilot sample is good enough.
    covers : (k,) int64
        Numbers of `levels.COVERAGES` of the pixels at borders.
    """

    pixels: Integers
    strata: Integers
    covers: Integers


PRECISE = 1.05
"""Precision of the multiplier, as a factor: numbers of samples follow its power 0.4."""


def allocate(
    variances: Floats,
    levels: NDArray[np.uint8],
    survey: Survey,
    goal: float,
    contrasts: Floats,
    coverage: NDArray[np.uint8],
) -> Allocation:
    """Distribute samples so that the sum of squared errors becomes `goal`, as far as samples predict it.

    Parameters
    ----------
    variances : (n,) float64
        Of single samples of the pixels that are sampled, so that they times n**-1.5 are squared errors.
    levels : (n,) uint8
        That they have; none gets fewer samples than it has.
    survey : Survey
        Of the pixels whose pilot sample is shown.
    goal : float
    contrasts : (k,) float64
        The same as `variances` for the rays that find what pixels at borders show.
    coverage : (k,) uint8
        Numbers of `levels.COVERAGES` that these have.
    """
    sampled, covered = _Sorts.of(variances, levels), _Sorts.of(contrasts, coverage)

    def left(multiplier: float) -> float:
        own = sampled.left(_levels(sampled.typical, multiplier), COUNTS)
        borders = covered.left(_covers(covered.typical, multiplier), _COVERED)
        return own + borders + float((survey.sizes * _strata_levels(survey, multiplier)[1]).sum())

    multiplier = _least(left, goal)
    return Allocation(
        pixels=np.maximum(_levels(variances, multiplier), levels),
        strata=_strata_levels(survey, multiplier)[0],
        covers=np.maximum(_covers(contrasts, multiplier), coverage),
    )


def cover_sizes(contrasts: Floats, goal: float) -> Integers:
    """Numbers of `levels.COVERAGES` (k,) that bring squared errors down to a sum of `goal`."""
    covered = _Sorts.of(contrasts, np.zeros(contrasts.size, np.uint8))

    def left(multiplier: float) -> float:
        return covered.left(_covers(covered.typical, multiplier), _COVERED)

    return _covers(contrasts, _least(left, goal))


@dataclass(frozen=True, slots=True, eq=False)
class _Sorts:
    """Pixels of about the same variance and the same level: how many there are (m,) of each sort."""

    typical: Floats
    have: Integers
    many: Integers

    @classmethod
    def of(cls, variances: Floats, levels: NDArray[np.uint8]) -> "_Sorts":
        """Pixels (n,)."""
        bins = np.clip(np.log2(np.maximum(variances, 1e-15)) * 4 + 200, 0, BINS - 1).astype(np.int64)
        sorts = np.bincount(bins * 32 + levels, minlength=BINS * 32)
        used = np.flatnonzero(sorts)
        return cls(2.0 ** ((used // 32 - 199.5) / 4), used % 32, sorts[used])

    def left(self, levels: Integers, counts: Integers) -> float:
        """Sum of the squared errors with these levels (m,) at least, which stand for `counts`."""
        return float((self.many * self.typical * counts[np.maximum(levels, self.have)] ** -1.5).sum())


def _levels(variances: Floats, multiplier: float) -> Integers:
    return levels_of((1.5 * variances * multiplier) ** 0.4)


def _covers(contrasts: Floats, multiplier: float) -> Integers:
    counts = (1.5 * contrasts * multiplier / RAY_PRICE) ** 0.4
    return np.searchsorted(_BETWEEN, counts)


_BETWEEN = np.sqrt(_COVERED[1:] * _COVERED[:-1])
"""Between two neighbouring coverages."""


def _strata_levels(survey: Survey, multiplier: float) -> tuple[Integers, Floats]:
    """Levels of the strata, and the squared error that a pixel of them is left with.

    A pilot sample stays where samples would not pay. Its probes must be sure of its error by two standard
    errors: to sample a whole stratum is never taken back.
    """
    levels = _levels(survey.variances, multiplier)
    kept = np.maximum(survey.errors - 2 * survey.uncertain, 0)
    sampled = survey.variances * COUNTS[levels] ** -1.5
    pays = sampled + COUNTS[levels] / multiplier < kept
    return levels * pays, sampled * pays + kept * ~pays


def _least(left: Callable[[float], float], goal: float) -> float:
    """The least multiplier, within `PRECISE`, that leaves no more than `goal`."""
    low, high = 1e-2, 1e14
    while high > PRECISE * low:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if left(middle) > goal else (low, middle)
    return float(high)
