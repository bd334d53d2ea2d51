"""How far two pictures are apart, in one number each.

All are of linear values clipped to 0..1, as the error of target quality is, and in float64.
"""

import math
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats
from renderer.math.numerics import EPS

RELATIVE_FLOOR = 0.01
"""Added to the squared reference in `relmse`: black pixels do not decide alone (Rousselle et al. 2011)."""

GUARD = 4 * EPS
"""Values up to 1 that should be equal differ by no more after a subtraction and a division."""


@dataclass(frozen=True, slots=True)
class Metrics:
    """Numbers about a picture a and its reference b, over all pixels and channels.

    Attributes
    ----------
    mse, rmse : float
        Mean of (a - b)^2, and its root.
    psnr : float
        -10 log10(mse), dB; inf for equal pictures.
    relmse : float
        Mean of (a - b)^2 / (b^2 + 0.01).
    max_abs : float
        Largest |a - b|.
    frac_over : float
        Share of pixels in which a channel differs by more than the limit.
    """

    mse: float
    rmse: float
    psnr: float
    relmse: float
    max_abs: float
    frac_over: float


def metrics(image: Floats, reference: Floats, limit: float) -> Metrics:
    """Metrics of linear pictures (H, W, 3), values 0..1.

    Parameters
    ----------
    limit
        Of `frac_over`. A difference equal to it but for rounding is not over it.

    Notes
    -----
    Sums are pairwise in float64: relative error below 64 eps for any picture that is accepted.
    """
    difference = image - reference
    squares = difference * difference
    mse = float(squares.mean())
    apart = np.abs(difference)
    over = (apart > limit + GUARD).any(axis=2)
    return Metrics(
        mse=mse,
        rmse=math.sqrt(mse),
        psnr=-10 * math.log10(mse) if mse > 0 else math.inf,
        relmse=float((squares / (reference * reference + RELATIVE_FLOOR)).mean()),
        max_abs=float(apart.max()),
        frac_over=float(np.count_nonzero(over)) / over.size,
    )
