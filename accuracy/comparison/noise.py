"""Whether a picture is noisier than random samples make it, where its reference states its own noise.

The errors of a reference and its numbers of samples give the variance of one sample in each pixel, and so the
variance of the mean of any number of them. Each squared difference, over the variance of the fewest samples
that are allowed, is 1 in the mean. The mean of a block, without the fifth of its pixels that are farthest
off, is then far below 1: 0.46 for normal noise and 0.55 at most for samples that say yes or no. Spots that
the mean leaves out, such as salt and pepper, count where a block has two of them.
"""

from dataclasses import dataclass

import numpy as np

from accuracy.comparison import variances
from accuracy.comparison.blocks import TRIMMED, gathered
from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats, Masks

SPOT = 10.0
"""Deviations of the allowed noise from which on a pixel is a spot. Samples that say yes once in 1700 or less
make them; the one that four samples make in 400 of such pixels is not enough for a block."""

SPOTS = 2
"""Spots that make a block noisy."""


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """How noisy the blocks of a picture are.

    Attributes
    ----------
    ratios : (rows, columns) float64
        Trimmed mean of the squared differences from the block's own weighted mean, each over the variance
        that is allowed in its pixel; or the second largest of them over 10 squared, if that is more. The
        largest of the channels.
    samples : int
        The fewest random samples that are allowed.
    """

    ratios: Floats
    samples: int

    @property
    def blocks(self) -> Masks:
        """Which blocks are noisier than so many samples make them.

        The mean of normal noise in 64 pixels lies 5 of its deviations below 1, so that one block in 10,000 is
        called noisier by chance; noise of 2.5 times the variance is found in 7 of 10 blocks.
        """
        return self.ratios > 1

    @property
    def share(self) -> float:
        """Share of blocks noisier than so many samples make them."""
        return float(np.count_nonzero(self.blocks)) / self.ratios.size


def sample_variances(reference: Picture) -> Floats | None:
    """Variance of one sample in each pixel, (H, W, 3), linear; None where the reference does not state it."""
    if not variances.known(reference):
        return None
    errors = reference.layers["error"].astype(np.float64)
    return np.asarray(errors * errors * reference.layers["samples"].astype(np.float64)[:, :, None])


def allowed_variances(reference: Picture, samples: int, rounding: Floats, tolerance: float) -> Floats | None:
    """Largest variance of a difference from a reference, (H, W, 3), linear; None where that is not stated.

    Parameters
    ----------
    samples
        The fewest random samples of a pixel.
    rounding : (H, W, 3)
        How far rounding may have moved each value: its variance is that of a uniform distribution.
    tolerance
        Differences that count nowhere may be of any sign: their square is added. It is above 0, or so is the
        noise of every pixel.
    """
    single = sample_variances(reference)
    if single is None:
        return None
    own = reference.layers["error"].astype(np.float64) ** 2
    return np.asarray(single / samples + own + rounding * rounding / 3 + tolerance * tolerance)


def noise(difference: Floats, allowed: Floats, samples: int) -> Noise:
    """Try all blocks of a difference (H, W, 3) against the variance that is allowed in each pixel."""
    blocks, weights = gathered(difference), 1 / gathered(allowed)
    pixels = blocks.shape[2]
    cut = int(TRIMMED * pixels)
    shares = np.sort(weights * (blocks - _means(blocks, weights, cut)) ** 2, axis=2)
    trimmed = shares[:, :, : pixels - 2 * cut].mean(axis=2)
    far = shares[:, :, -SPOTS:].min(axis=2) / SPOT**2
    return Noise(np.maximum(trimmed, far).max(axis=2), samples)


def _means(blocks: Floats, weights: Floats, cut: int) -> Floats:
    """Trimmed means, (rows, columns, 1, 3): noisy pixels weigh little, or they would move them."""
    inner = np.argsort(blocks, axis=2)[:, :, cut : blocks.shape[2] - cut]
    kept, weight = (np.take_along_axis(values, inner, axis=2) for values in (blocks, weights))
    return np.asarray((weight * kept).sum(axis=2, keepdims=True) / weight.sum(axis=2, keepdims=True))
