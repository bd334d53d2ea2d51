"""Ratings of explanations: how much less of a picture's difference one leaves than another.

An explanation is a picture that a mistake makes of the reference, or the submitted one without the mistake;
both leave a difference. One statistic rates them, of single pictures and of those of a whole program.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from accuracy.comparison.blocks import gathered
from renderer.math.arrays import Floats

MAX_RMSE_LEFT = 0.5
"""An explanation is clear where it leaves less than this share of the RMSE."""

MIN_GAIN = 0.1
"""Least share of the mean square, in the blocks where they differ, by which a sure explanation is closer."""

MIN_GAIN_ERRORS = 3.5
"""Least standard errors of the gain of a sure explanation: one false alarm in 4,300. With 4 a cosine that is
not clamped is not named in hard shadows; with 3.5 `benchmarks.grading` names no mistake wrongly."""

MAX_GAIN_ERRORS = 10.0
"""One picture says no more than this about a program."""

FLOOR = 0.002
"""Explanations that differ by less in a block, linear, are the same there: half a step of 8 bits."""

LEAST_BLOCKS = 4
"""Blocks in which two explanations must differ, for their standard error to mean anything."""


@dataclass(frozen=True, slots=True)
class Rating:
    """Rating of an explanation against another one.

    Attributes
    ----------
    left, other : float
        Mean squares of the differences that both leave.
    errors : float
        Standard errors of its blocks by which it is closer, where both differ; 0 if they do in too few.
    is_large : bool
        Whether it is closer by more than noise and what is allowed in these blocks.
    """

    left: float
    other: float
    errors: float
    is_large: bool

    @classmethod
    def of(cls, bands: Iterable[tuple[Floats, ...]]) -> "Rating":
        """Rate by the differences that an explanation and the other leave, and what is allowed, band by band.

        All are (H, W, 3), linear.
        """
        sums, blocks = np.zeros(3), list[Floats]()
        for left, other, allowed in bands:
            squares = left * left, other * other, (left - other) ** 2
            sums += squares[0].sum(), squares[1].sum(), left.size
            blocks.append(np.array([_in_blocks(values) for values in (*squares, allowed)]))
        means = float(sums[0] / sums[2]), float(sums[1] / sums[2])
        left, other, apart, allowed = np.concatenate(blocks, axis=1)
        shown = apart > FLOOR**2
        if np.count_nonzero(shown) < LEAST_BLOCKS:
            return cls(*means, 0.0, is_large=False)
        gains = (other - left)[shown]
        # A slope moved by a pixel looks like a bias so small that it is allowed.
        large = gains.mean() >= max(MIN_GAIN * other[shown].mean(), allowed[shown].mean() ** 2)
        return cls(*means, _errors(gains, apart[shown]), is_large=bool(large))

    @property
    def is_clear(self) -> bool:
        """Whether it leaves less than half of the RMSE."""
        return self.left < MAX_RMSE_LEFT**2 * self.other

    @property
    def is_sure(self) -> bool:
        """Whether it is closer beyond doubt, so that pictures which then agree are explained."""
        return self.is_large and self.errors >= MIN_GAIN_ERRORS


def _errors(gains: Floats, apart: Floats) -> float:
    # A picture that is as explained is closer by as much as the two explanations are apart.
    others = gains - gains.sum() / apart.sum() * apart
    spread = math.sqrt(float((others * others).sum()) * gains.size / (gains.size - 1))
    total = float(gains.sum())
    errors = total / spread if spread else math.copysign(MAX_GAIN_ERRORS, total)
    return min(max(errors, -MAX_GAIN_ERRORS), MAX_GAIN_ERRORS)


def _in_blocks(values: Floats) -> Floats:
    """Means of blocks over all channels, (N,)."""
    return np.asarray(gathered(values.mean(axis=2)).mean(axis=2).ravel())
