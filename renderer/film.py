"""Film: accumulates samples into pixel means."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats, Integers
from renderer.math.numerics import halving_sum
from schemas.tiles import Pass, Tile

Image = NDArray[np.float32]
"""(H, W, 3) float32, linear."""

BRIGHTEST = float(np.finfo(np.float32).max)
"""Brighter pixels of a pass are clamped to this, and brighter samples where their variance is recorded."""


class Film:
    """The pixels of one tile in one pass.

    Parameters
    ----------
    tile : Tile
    pass_ : Pass
        With a stride, one value stands for stride x stride pixels.

    Attributes
    ----------
    mean : (h, w, 3) float64
        Mean of the samples of each pixel; 0 where there are none yet.
    """

    def __init__(self, tile: Tile, pass_: Pass) -> None:
        self._tile, self._stride = tile, pass_.stride
        self._samples = pass_.last - pass_.first
        height, width = -(-tile.height // pass_.stride), -(-tile.width // pass_.stride)
        self.mean = np.zeros((height, width, 3))

    def add(self, columns: Integers, rows: Integers, radiance: Floats) -> None:
        """Take the samples (3, P * S) of P pixels, those of one pixel together, ordered by number.

        They are summed in place: `radiance` is overwritten.
        """
        # By halves, in an order that the number of samples alone decides: no pixel depends on its block.
        total = halving_sum(radiance.reshape(-1, self._samples).T).reshape(3, columns.size)
        x, y = (columns - self._tile.x0) // self._stride, (rows - self._tile.y0) // self._stride
        self.mean[y, x] = (total / self._samples).T

    def image(self) -> Image:
        """The mean over the pass's samples; clamped to the largest float32."""
        return np.minimum(self.mean, BRIGHTEST).astype(np.float32)


def compose(parts: Sequence[tuple[Pass, Image]]) -> Image:
    """The mean so far of one tile from its finished passes.

    Parameters
    ----------
    parts
        Passes, in order, with their pixels. The preview is ignored.

    Returns
    -------
    (h, w, 3) float32
        Added in float64 in the order of the passes.

    Raises
    ------
    ValueError
        If no pass but the preview is given.
    """
    rounds = [(pass_.last - pass_.first, pixels) for pass_, pixels in parts if pass_.stride == 1]
    if not rounds:
        raise ValueError("nothing but a preview to compose")
    total = np.zeros(rounds[0][1].shape)
    for samples, pixels in rounds:
        total += samples * pixels.astype(np.float64)
    return (total / sum(samples for samples, _ in rounds)).astype(np.float32)


def non_finite(image: Image) -> int:
    """Number of pixels with a channel that is NaN or infinite."""
    return int(np.count_nonzero(~np.isfinite(image).all(axis=2)))


def clamped(parts: Sequence[tuple[Pass, Image]]) -> int:
    """Number of pixels of a tile that are clamped, as some pass exceeded float32.

    Their mean may be smaller: passes keep only clamped values.
    """
    return int(np.count_nonzero(np.any([(pixels >= BRIGHTEST).any(axis=2) for _, pixels in parts], axis=0)))


def enlarge(pixels: Image, stride: int, height: int, width: int) -> Image:
    """A preview at full size: each value fills its stride x stride pixels."""
    return pixels.repeat(stride, axis=0).repeat(stride, axis=1)[:height, :width]
