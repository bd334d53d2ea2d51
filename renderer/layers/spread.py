"""The estimated error of each pixel, from the spread of its camera samples.

A record holds for each pixel the mean of its samples, the sum of squares about it, and their number. It is
formed from differences to the pixel's first sample, and records merge by Chan, Golub and LeVeque (1979), so
that nothing cancels, and a pixel whose samples are all equal has an error of exactly 0.
"""

import numpy as np

from renderer.film import BRIGHTEST, Image
from renderer.math.arrays import Floats, Integers
from schemas.tiles import Pass, Tile

MEANS, SQUARES, COUNTS = slice(0, 3), slice(3, 6), 6
"""Places in a record (7, h, w) float64."""


class Spread:
    """Records the samples of one tile in one pass.

    Parameters
    ----------
    tile : Tile
    pass_ : Pass
        Not the preview.
    """

    def __init__(self, tile: Tile, pass_: Pass) -> None:
        self._tile, self._samples = tile, pass_.last - pass_.first
        self.record = np.zeros((7, tile.height, tile.width))
        self.record[COUNTS] = self._samples

    def add(self, columns: Integers, rows: Integers, radiance: Floats) -> None:
        """Take the samples (3, P * S) of P pixels, those of one pixel together, ordered by number."""
        samples = np.minimum(radiance, BRIGHTEST).reshape(3, columns.size, self._samples)
        first = samples[:, :, 0]
        total = np.zeros_like(first)
        for sample in range(1, self._samples):
            total += samples[:, :, sample] - first
        mean = first + total / self._samples
        squares = np.zeros_like(first)
        for sample in range(self._samples):
            squares += (samples[:, :, sample] - mean) ** 2
        x, y = columns - self._tile.x0, rows - self._tile.y0
        self.record[MEANS, y, x], self.record[SQUARES, y, x] = mean, squares


def merged(one: Floats, other: Floats) -> Floats:
    """The record of the samples of both, in this order."""
    count = one[COUNTS] + other[COUNTS]
    share = other[COUNTS] / count
    apart = other[MEANS] - one[MEANS]
    squares = one[SQUARES] + other[SQUARES] + apart * apart * (one[COUNTS] * share)
    return np.concatenate((one[MEANS] + apart * share, squares, count[None]))


def standard_errors(record: Floats) -> Image:
    """Estimated standard errors of the means, (h, w, 3): sqrt(squares / (n (n - 1))), inf if n < 2."""
    count = record[COUNTS]
    variances = np.full_like(record[SQUARES], np.inf)
    np.divide(record[SQUARES], count * (count - 1), out=variances, where=count > 1)
    return np.sqrt(variances).transpose(1, 2, 0).astype(np.float32)
