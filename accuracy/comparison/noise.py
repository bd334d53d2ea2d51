"""Detection of noise larger than that of random samples, for references that state their noise.

The errors and sample counts of a reference give the variance of one sample in each pixel, and so of the mean
of any number of them. A squared difference, divided by the variance of the fewest samples that are allowed,
is 1 on average. The mean over a block, without the fifth of its pixels with the largest ones, is far below 1:
0.46 for normal noise, and at most 0.55 for samples of 0 or 1. Spots that the trimmed mean excludes, such as
salt and pepper, count if a block has two of them. Adjacent pixels with equal errors are a mistake of another
kind.
"""

from dataclasses import dataclass

import numpy as np

from accuracy.comparison.blocks import BLOCK_SIDE, TRIMMED_SHARE, gathered
from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats, Integers, Masks

MIN_GRAIN = 0.5
"""A block has grain if the mean squared difference of neighbours is at least this, relative to twice its
variance. Independent pixels have 1, with a deviation of 0.1; a displaced edge of a shape has at most 1/3."""

SPOT_DEVIATIONS = 10.0
"""A pixel that is off by more deviations of the allowed noise is a spot. Samples that are 1 once in 1700 or
less cause them, but four samples a pixel make only one in 400 pixels, too few for a block."""

MIN_SPOTS = 2
"""Number of spots that make a block noisy."""


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Noise of the blocks of a picture.

    Attributes
    ----------
    ratios : (rows, columns) float64
        Trimmed mean of the squared differences from the block's own weighted mean, each over the variance
        that is allowed in its pixel; the largest of the channels with grain, 0 where none has.
    spots : (rows, columns) int64
        Pixels that are off by more than `SPOT_DEVIATIONS`, without such a neighbour.
    samples : int
        Fewest random samples allowed.
    """

    ratios: Floats
    spots: Integers
    samples: int

    @property
    def blocks(self) -> Masks:
        """Mask of blocks that are noisier than the allowed number of samples makes them.

        For normal noise the trimmed mean over 64 pixels is 5 of its deviations below 1, so that one block in
        10,000 counts by chance; 7 in 10 blocks do with 2.5 times the variance.
        """
        return (self.ratios > 1) | (self.spots >= MIN_SPOTS)

    @property
    def share(self) -> float:
        """Share of blocks noisier than the allowed number of samples makes them."""
        return float(np.count_nonzero(self.blocks)) / self.ratios.size


def sample_variances(reference: Picture) -> Floats:
    """Variance of one sample in each pixel, (H, W, 3), linear, of a reference whose errors are `known`."""
    errors = reference.layers["error"].astype(np.float64)
    return np.asarray(errors * errors * reference.layers["samples"].astype(np.float64)[:, :, None])


def allowed_variances(reference: Picture, samples: int, rounding: Floats, tolerance: float) -> Floats:
    """Largest variance of a difference from a reference whose errors are `known`, (H, W, 3), linear.

    Parameters
    ----------
    samples
        The fewest random samples of a pixel.
    rounding : (H, W, 3)
        Bound on the rounding of each value: its variance is that of a uniform distribution.
    tolerance
        Always tolerated difference, of either sign: its square is added. It or the noise of every pixel is
        above 0.
    """
    single = sample_variances(reference)
    own = reference.layers["error"].astype(np.float64) ** 2
    return np.asarray(single / samples + own + rounding * rounding / 3 + tolerance * tolerance)


def noise(difference: Floats, allowed: Floats, samples: int) -> Noise:
    """Compare all blocks of a difference (H, W, 3) with the allowed variance of each pixel."""
    return judged(*excesses(difference, allowed), samples)


def judged(ratios: Floats, spots: Masks, samples: int) -> Noise:
    """The noise of a picture by the `excesses` of all its blocks and pixels."""
    return Noise(ratios, gathered(_alone(spots)).sum(axis=2, dtype=np.int64), samples)


def excesses(difference: Floats, allowed: Floats) -> tuple[Floats, Masks]:
    """`Noise.ratios` of the blocks of a difference (H, W, 3), and which pixels (H, W) are spots."""
    blocks, weights = gathered(difference), 1 / gathered(allowed)
    pixels = blocks.shape[2]
    cut = int(TRIMMED_SHARE * pixels)
    scaled = np.sqrt(weights) * (blocks - _means(blocks, weights, cut))
    trimmed = np.sort(scaled * scaled, axis=2)[:, :, : pixels - 2 * cut].mean(axis=2)
    trimmed[unlikeness(scaled, difference.shape) < MIN_GRAIN] = 0
    return trimmed.max(axis=2), np.asarray(
        (difference * difference > SPOT_DEVIATIONS**2 * allowed).any(axis=2)
    )


def unlikeness(blocks: Floats, shape: tuple[int, ...]) -> Floats:
    """Mean square of the differences of neighbours over twice the variance, (rows, columns, 3).

    Parameters
    ----------
    blocks : (rows, columns, pixels of a block, 3)
        As `blocks.gathered` makes them.
    shape
        Of the picture.
    """
    high, wide = (min(BLOCK_SIDE, length) for length in shape[:2])
    squares = blocks.reshape(*blocks.shape[:2], high, wide, 3)
    steps = [np.diff(squares, axis=axis) for axis, length in ((2, high), (3, wide)) if length > 1]
    mean = sum((step * step).mean(axis=(2, 3)) for step in steps) / max(len(steps), 1)
    variance = 2 * blocks.var(axis=2)
    return np.divide(mean, variance, out=np.zeros_like(variance), where=variance > 0)


def _alone(chosen: Masks) -> Masks:
    """Isolated pixels of a mask (H, W): none of the eight neighbours is set."""
    height, width = chosen.shape
    padded = np.pad(chosen, 1).astype(np.int8)
    around = sum(padded[y : y + height, x : x + width] for y in range(3) for x in range(3))
    return np.asarray(chosen & (around == 1))


def _means(blocks: Floats, weights: Floats, cut: int) -> Floats:
    """Trimmed means, (rows, columns, 1, 3), with little weight for noisy pixels."""
    inner = np.argsort(blocks, axis=2)[:, :, cut : blocks.shape[2] - cut]
    kept, weight = (np.take_along_axis(values, inner, axis=2) for values in (blocks, weights))
    return np.asarray((weight * kept).sum(axis=2, keepdims=True) / weight.sum(axis=2, keepdims=True))
