"""Test of two noisy pictures for equal means, if both state the noise of each pixel.

A block's mean averages the noise of all its pixels, so that the difference of two means over its standard
error is nearly normal. One false alarm in a thousand is divided among all blocks and channels (Sidak 1967).
"""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison.blocks import gathered
from accuracy.comparison.inputs import Picture
from accuracy.statistics import normal_equivalent, normal_limit, shared_out
from renderer.math.arrays import Floats

FALSE_ALARMS = 0.001
"""Probability of a false alarm in all blocks together."""


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """Result of the test for each block.

    Attributes
    ----------
    ratios : (rows, columns) float64
        |z| over the z that noise exceeds in any block with probability `FALSE_ALARMS`, the largest channel's.
    largest : float
        The largest |z|.
    limit : float
        The z that noise exceeds.
    """

    ratios: Floats
    largest: float
    limit: float

    @property
    def differs(self) -> bool:
        """Whether any block differs by more than noise explains."""
        return bool(self.largest > self.limit)


def known(picture: Picture) -> bool:
    """Whether a picture has the layers ``error`` and ``samples``, and 2 samples or more in each pixel."""
    error, samples = picture.layers.get("error"), picture.layers.get("samples")
    return (
        error is not None and samples is not None and bool(np.isfinite(error).all() and (samples > 1).all())
    )


def block_scores(image: Picture, reference: Picture, allowed: Floats) -> Floats:
    """|z| of each block and channel, (rows, columns, 3), of two pictures whose errors are `known`.

    A mean difference up to the mean of `allowed` (H, W, 3) counts as none.

    The error of a block is itself an estimate: its degrees of freedom are those of Welch (1947) and
    Satterthwaite (1946), and their t is converted to the equally rare z.
    """
    means = _block_means(image) - _block_means(reference)
    variances, weights = np.zeros_like(means), np.zeros_like(means)
    for picture in (image, reference):
        squares = picture.layers["error"].astype(np.float64) ** 2
        freedom = picture.layers["samples"].astype(np.float64)[:, :, None] - 1
        variances += gathered(squares).sum(axis=2)
        weights += gathered(squares * squares / freedom).sum(axis=2)
    pixels = gathered(image.linear[:, :, 0]).shape[2]
    excess = np.maximum(np.abs(means) - gathered(allowed).mean(axis=2), 0.0)
    return _rare(excess, np.sqrt(variances) / pixels, variances, weights)


def scores(z: Floats) -> Scores:
    """Scores by the |z| of all blocks and channels, (rows, columns, 3)."""
    bound = normal_limit(shared_out(FALSE_ALARMS, z.size))
    return Scores(z.max(axis=2) / bound, float(z.max()), bound)


def _block_means(picture: Picture) -> Floats:
    return gathered(picture.linear).mean(axis=2)


def _rare(excess: Floats, errors: Floats, variances: Floats, weights: Floats) -> Floats:
    ratios = np.where(excess > 0, math.inf, 0.0)
    np.divide(excess, errors, out=ratios, where=errors > 0)
    freedom = np.full_like(variances, math.inf)
    np.divide(variances * variances, weights, out=freedom, where=weights > 0)
    z = normal_equivalent(np.minimum(ratios, 1e100), freedom)
    return np.where(np.isinf(ratios), math.inf, z)
