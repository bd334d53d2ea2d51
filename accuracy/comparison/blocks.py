"""Biased blocks: small parts of a picture that are brighter or darker than noise explains.

Noise averages out over a block, a mistake does not. In each block of 8 x 8 pixels the differences of a
channel are tested for a mean of 0 by the trimmed t of Tukey and McLaughlin (1963): a tenth at each end is
left out of the mean and winsorised in the variance, so that a few fireflies do not hide the rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.statistics import shared_out
from renderer.math.arrays import Floats, Masks
from renderer.math.intervals import student

BLOCK_SIDE = 8
"""Pixels along a block: enough for a mean of 64, small enough to lie on one surface."""

TRIMMED_SHARE = 0.1
"""Share of the differences left out at each end."""

BIAS_FALSE_ALARMS = 0.001
"""Probability that noise alone makes a block biased."""

SINGLE_BLOCK_FALSE_ALARMS = 1e-6
"""Probability that noise alone puts some block of a picture beyond doubt."""

SINGLE_BLOCK_TOLERANCES = 5.0
"""Least bias of a block beyond doubt, in tolerances: fixed patterns of samples stay below, even at edges."""


@dataclass(frozen=True, slots=True, eq=False)
class Bias:
    """Result of the test for each block.

    Attributes
    ----------
    ratios : (rows, columns) float64
        |t| over the t that noise exceeds with probability `BIAS_FALSE_ALARMS`, the largest channel's; inf
        where a block without noise differs.
    excess : (rows, columns) float64
        Excess of the trimmed mean over the allowed one, of the worst channel, linear.
    pixels : int
        Of a block.
    """

    ratios: Floats
    excess: Floats
    pixels: int = BLOCK_SIDE * BLOCK_SIDE

    @classmethod
    def joined(cls, parts: Sequence["Bias"]) -> "Bias":
        """Bias of a picture, joined from its bands."""
        ratios, excess = (
            np.concatenate([getattr(each, name) for each in parts]) for name in ("ratios", "excess")
        )
        return cls(ratios, excess, parts[0].pixels)

    @property
    def blocks(self) -> Masks:
        """Mask of the biased blocks."""
        return self.ratios > 1

    @property
    def share(self) -> float:
        """Share of biased blocks."""
        return float(np.count_nonzero(self.ratios > 1)) / self.ratios.size

    def beyond_doubt(self, tolerance: float) -> Masks:
        """Blocks off by `SINGLE_BLOCK_TOLERANCES`, with a t that noise almost never reaches."""
        freedom = _freedom(self.pixels)
        if freedom <= 0:
            return np.zeros(self.ratios.shape, dtype=bool)
        rare = student(freedom, shared_out(SINGLE_BLOCK_FALSE_ALARMS, 3 * self.ratios.size)) / limit(
            self.pixels
        )
        return (self.ratios > rare) & (self.excess > SINGLE_BLOCK_TOLERANCES * tolerance)


def starts(length: int) -> list[int]:
    """First pixels of blocks along a side; the last block ends at the border and may overlap."""
    side = min(BLOCK_SIDE, length)
    return [*range(0, length - side, BLOCK_SIDE), length - side]


def gathered(values: NDArray[Any]) -> NDArray[Any]:
    """Pixels block by block, (H, W, ...) -> (rows, columns, pixels of a block, ...)."""
    height, width = values.shape[:2]
    high, wide = min(BLOCK_SIDE, height), min(BLOCK_SIDE, width)
    if height % high == 0 and width % wide == 0:
        shape = (height // high, high, width // wide, wide, *values.shape[2:])
        whole = values.reshape(shape).swapaxes(1, 2)
    else:
        rows = np.add.outer(starts(height), np.arange(high))
        columns = np.add.outer(starts(width), np.arange(wide))
        whole = values[rows[:, None, :, None], columns[None, :, None, :]]
    return whole.reshape(*whole.shape[:2], high * wide, *values.shape[2:])


def bias(difference: Floats, allowed: Floats, most: Floats | None = None) -> Bias:
    """Test all blocks.

    Parameters
    ----------
    difference : (H, W, 3)
        Linear.
    allowed : (H, W, 3)
        A block is unbiased if its mean is at most that of `allowed`: in a flat block all pixels are rounded
        alike, and a fixed pattern of samples has the same error everywhere.
    most : (H, W, 3), optional
        Largest variance of noise in each pixel. More is reduced to it, since noise must not hide a mistake.
    """
    ordered = np.sort(gathered(difference), axis=2)
    pixels = ordered.shape[2]
    cut = int(TRIMMED_SHARE * pixels)
    inner = ordered[:, :, cut : pixels - cut]
    mean = inner.mean(axis=2)
    kept = pixels - 2 * cut
    # Winsorising: the ends are replaced by the last value kept.
    squares = ((inner - mean[:, :, None]) ** 2).sum(axis=2)
    low, high = inner[:, :, 0] - mean, inner[:, :, -1] - mean
    squares += cut * (low * low + high * high)
    squares -= (cut * (low + high)) ** 2 / pixels
    if most is not None:
        squares = np.minimum(squares, _expected_squares(most, cut))
    error = np.sqrt(np.maximum(squares, 0) * pixels / max(pixels - 1, 1)) / kept
    excess = np.maximum(np.abs(mean) - gathered(allowed).mean(axis=2), 0)
    return Bias(_over(excess, error * limit(pixels)).max(axis=2), excess.max(axis=2), pixels)


def _expected_squares(variances: Floats, cut: int) -> Floats:
    """Sums of squares of winsorised noise, (rows, columns, 3), at most.

    Winsorising draws in `cut` pixels at each end: that many, the noisiest, count like the next.
    """
    ordered = np.sort(gathered(variances), axis=2)
    last = ordered.shape[2] - cut - 1
    return np.asarray(np.minimum(ordered, ordered[:, :, last : last + 1]).sum(axis=2))


def limit(pixels: int) -> float:
    """The |t| that noise exceeds in one of three channels with probability `BIAS_FALSE_ALARMS`."""
    freedom = _freedom(pixels)
    return student(freedom, shared_out(BIAS_FALSE_ALARMS, 3)) if freedom > 0 else math.inf


def _freedom(pixels: int) -> int:
    return pixels - 2 * int(TRIMMED_SHARE * pixels) - 1


def _over(excess: Floats, bounds: Floats) -> Floats:
    ratios = np.where(excess > 0, np.inf, 0.0)
    np.divide(excess, bounds, out=ratios, where=(bounds > 0) & (excess > 0))
    return ratios
