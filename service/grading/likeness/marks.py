"""A watermark in the references that results show, which identifies copies of them.

Each block of 4 x 4 pixels is shown one code brighter or darker, by a sign derived from the reference's file,
which students do not have. A picture that was not made from the shown one is independent of the signs. So by
Hoeffding's inequality (1963) the sum of its signed differences from the reference exceeds z times the root of
the sum of their squares with a probability of at most exp(-z^2 / 2).
"""

import hashlib
import math
from dataclasses import replace

import numpy as np

from accuracy.comparison import Picture
from accuracy.comparison.heat import seen
from accuracy.comparison.pixels import Pixels
from renderer.math.arrays import Floats

BLOCK_SIDE = 4
"""Side of a block, pixels: a blur that removes blocks of this size costs points."""

MOST_CODES = 2.0
"""Differences are clipped to so many codes, so that a few wrong blocks do not hide the mark elsewhere."""

FALSE_ALARM_PROBABILITY = 1e-6
"""Largest probability with which an independent picture is reported."""


def marked(reference: Picture) -> Picture:
    """A reference as results show it."""
    signs, columns, row = _signs(reference), np.arange(reference.width) // BLOCK_SIDE, 0
    codes = np.empty((reference.height, reference.width, 3), np.uint8)
    for band in reference.bands():
        rows = np.arange(row, row + band.height)
        codes[rows] = np.clip(seen(band) + signs[rows[:, None] // BLOCK_SIDE, columns, None], 0, 255)
        row += band.height
    return replace(reference, pixels=Pixels(codes, "srgb"))


def is_marked(image: Picture, reference: Picture) -> bool:
    """Whether a picture was made from the marked reference; both have the same size."""
    both = zip(image.bands(), reference.bands(), strict=True)
    blocks = np.concatenate([_apart(*band) for band in both])
    # Subtract the neighbours' mean: another exposure or encoding changes it by as much.
    around = np.pad(blocks, 1, mode="edge")
    blocks = blocks - (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
    counted = np.clip(blocks, -MOST_CODES, MOST_CODES)
    surprise = np.sum(counted * _signs(reference)[: blocks.shape[0], : blocks.shape[1]])
    return bool(surprise > math.sqrt(-2 * math.log(FALSE_ALARM_PROBABILITY) * np.sum(counted * counted)))


def _apart(image: Picture, reference: Picture) -> Floats:
    """Differences of whole blocks, codes."""
    apart = 255 * (image.pixels.seen - reference.pixels.seen).mean(axis=2)
    rows, columns = (size // BLOCK_SIDE for size in apart.shape)
    whole = apart[: rows * BLOCK_SIDE, : columns * BLOCK_SIDE]
    return whole.reshape(rows, BLOCK_SIDE, columns, BLOCK_SIDE).mean(axis=(1, 3))


def _signs(reference: Picture) -> Floats:
    """The sign of each block, incomplete ones at the border included."""
    seed = int(hashlib.sha256(b"mark " + reference.sha256.encode()).hexdigest(), 16)
    size = -(-reference.height // BLOCK_SIDE), -(-reference.width // BLOCK_SIDE)
    signs: Floats = np.random.default_rng(seed).choice((-1.0, 1.0), size)
    return signs
