"""A mark in the references that results show, by which a picture made from one of them is known again.

Each block of 4 x 4 pixels is shown one code brighter or darker, by a sign that follows from the reference's
file, which students do not have. A picture that was made without the shown one is independent of the signs,
right or wrong, with whatever noise. So by Hoeffding's inequality (1963) its differences from the reference,
each times its sign, have a sum above z times the root of their squares' with a probability of at most
exp(-z^2 / 2).
"""

import hashlib
import math
from dataclasses import replace

import numpy as np

from accuracy.comparison import Picture
from accuracy.comparison.heat import seen
from accuracy.comparison.pixels import Pixels
from renderer.math.arrays import Floats

SIDE = 4
"""Pixels: a blur that removes blocks of this size costs points."""

LOUDEST = 2.0
"""Codes to which a difference is cut, so that a few wrong places do not hide the mark elsewhere."""

LEVEL = 1e-6
"""Probability of a false alarm, at most."""


def marked(reference: Picture) -> Picture:
    """A reference as results show it."""
    signs, columns, row = _signs(reference), np.arange(reference.width) // SIDE, 0
    codes = np.empty((reference.height, reference.width, 3), np.uint8)
    for band in reference.bands():
        rows = np.arange(row, row + band.height)
        codes[rows] = np.clip(seen(band) + signs[rows[:, None] // SIDE, columns, None], 0, 255)
        row += band.height
    return replace(reference, pixels=Pixels(codes, "srgb"))


def is_marked(image: Picture, reference: Picture) -> bool:
    """Whether a picture was made from the marked reference; both have the same size."""
    both = zip(image.bands(), reference.bands(), strict=True)
    blocks = np.concatenate([_apart(*band) for band in both])
    # Another exposure or encoding moves neighbours alike.
    around = np.pad(blocks, 1, mode="edge")
    blocks = blocks - (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
    counted = np.clip(blocks, -LOUDEST, LOUDEST)
    surprise = np.sum(counted * _signs(reference)[: blocks.shape[0], : blocks.shape[1]])
    return bool(surprise > math.sqrt(-2 * math.log(LEVEL) * np.sum(counted * counted)))


def _apart(image: Picture, reference: Picture) -> Floats:
    """Differences of whole blocks, codes."""
    apart = 255 * (image.pixels.seen - reference.pixels.seen).mean(axis=2)
    rows, columns = (size // SIDE for size in apart.shape)
    return apart[: rows * SIDE, : columns * SIDE].reshape(rows, SIDE, columns, SIDE).mean(axis=(1, 3))


def _signs(reference: Picture) -> Floats:
    """The sign of each block, those cut off by the border included."""
    seed = int(hashlib.sha256(b"mark " + reference.sha256.encode()).hexdigest(), 16)
    size = -(-reference.height // SIDE), -(-reference.width // SIDE)
    signs: Floats = np.random.default_rng(seed).choice((-1.0, 1.0), size)
    return signs
