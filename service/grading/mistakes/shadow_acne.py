"""Detect shadow acne: surfaces that shadow themselves at random, as rounding decides."""

from __future__ import annotations

import numpy as np

from accuracy.comparison.diagnosis import Cause
from renderer.math.arrays import Floats, Masks
from service.grading.mistakes.hints import HINTS

CAUSE = "shadow_acne"

BRIGHT = 0.05
"""Least direct light of a pixel, as a mean of channels, that shows how much of it arrives."""

WHITE = 0.98
"""Brighter channels may be clipped, so their share of the light is unknown."""

SMOOTH = 0.1
"""Neighbours are compared where their direct light differs by no more than this share."""

MOST = 0.9
"""Largest mean share of the light that arrives; about half of it does."""

LEAST = 0.1
"""Smallest one: darker pictures lack the light."""

SAMPLES = 100
"""The spread of neighbours must be at least that of so many shadow rays a pixel, each blocked at random;
quantisation and correct sampling spread far less where the light is fully visible."""

LEFT = 0.75
"""Largest share of the RMSE that may remain; 4 rays a pixel of which 3 arrive leave 0.65."""

MEDIAN = 0.6745 * 2**0.5
"""Median absolute difference of two independent normal numbers of variance 1."""

FEWEST = 64
"""Fewest pairs of neighbours; the correlation of 64 pairs has a standard deviation of 1/8."""


def acne(dark: Floats, image: Floats, reference: Floats) -> Cause | None:
    """The cause, if a random share of the direct light is missing nearly everywhere.

    Parameters
    ----------
    dark
        The scene without its lights.
    image, reference
        All three are linear, (H, W, 3).

    Notes
    -----
    `rmse_after` is the RMSE that remains if each pixel receives the mean share of its surroundings.
    """
    direct = (reference - dark).mean(axis=2)
    lit = (direct > BRIGHT) & (np.maximum(image, reference).max(axis=2) < WHITE)
    share = np.divide((image - dark).mean(axis=2), direct, out=np.zeros_like(direct), where=lit)
    first, second = _neighbours(share, direct, lit)
    if first.size < FEWEST:
        return None
    mean = float((first.mean() + second.mean()) / 2)
    # By the median: in a penumbra, correct pixels spread as well.
    noise = float(np.median(np.abs(first - second)) / MEDIAN) ** 2
    if not LEAST < mean < MOST or noise < mean * (1 - mean) / SAMPLES:
        return None
    left = image - (dark + _around(share, lit)[:, :, None] * (reference - dark))
    before, after = (float(np.sqrt(np.mean(part * part))) for part in (image - reference, left))
    return Cause(CAUSE, HINTS[CAUSE], before, after) if after < LEFT * before else None


def _neighbours(share: Floats, direct: Floats, lit: Masks) -> tuple[Floats, Floats]:
    """Shares of horizontal neighbours on which the same light falls, (N,) each."""
    left, right = direct[:, :-1], direct[:, 1:]
    alike = lit[:, :-1] & lit[:, 1:] & (np.abs(left - right) <= SMOOTH * np.minimum(left, right))
    return share[:, :-1][alike], share[:, 1:][alike]


def _around(share: Floats, lit: Masks) -> Floats:
    """Mean shares over the lit ones of 5 x 5 pixels, (H, W); 1 where none is lit."""
    total, count = _boxes(np.where(lit, share, 0)), _boxes(lit.astype(np.float64))
    return np.divide(total, count, out=np.ones_like(total), where=count > 0)


def _boxes(values: Floats) -> Floats:
    """Sums over 5 x 5 pixels, (H, W)."""
    sums: Floats = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2), (5, 5)).sum(axis=(2, 3))
    return sums
