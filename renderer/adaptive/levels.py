"""How many camera samples a pixel has been given: a level, a number small enough for a map of the picture.

Level 0 is none: the pixel's value is interpolated. Level 1 is one ray through its middle, the pilot sample.
Level 2 is a pixel at a border: rays all over it found what it shows (`coverage`). Level n from 3 on is
2**(n - 1) samples in two independent halves.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats, Integers

Levels = NDArray[np.uint8]
"""(H, W) uint8."""

PREVIEWED, COVERED, SAMPLED = 1, 2, 3
"""Levels of a pilot sample and of a pixel at a border, and the first level with samples."""

HIGHEST = 17
"""65,536 samples: fixed quality accepts no more either."""

COUNTS = np.array([0, 0, 0, *(1 << level - 1 for level in range(SAMPLED, HIGHEST + 1))], dtype=np.int64)
"""Camera samples at each level, without those of pilot samples."""

FIBONACCI = (
    2,
    3,
    5,
    8,
    13,
    21,
    34,
    55,
    89,
    144,
    233,
    377,
    610,
    987,
    1597,
    2584,
    4181,
    6765,
    10946,
    17711,
    28657,
)
"""Rays in one of the two lattices that find what a border pixel shows."""

COVERAGES = np.array([0, *(2 * count for count in FIBONACCI)], dtype=np.int64)
"""Rays of both lattices, by the number that maps keep."""

RAY_PRICE = 1 / 12
"""CPU time of a ray that finds what a pixel shows, over that of a camera sample, on `soft` and `chess`."""


def levels_of(counts: Floats) -> Integers:
    """The levels nearest to some numbers of samples, by their logarithms."""
    levels = np.rint(np.log2(np.maximum(counts, 1))) + 1
    return np.clip(levels, SAMPLED, HIGHEST).astype(np.int64)


NODES = 8, 4 / 255
"""Samples of a new node, and the error for which they are enough; smaller errors need proportionally more."""

MOST = 128
"""Most samples of a new node: they show how many more it needs."""


def node_level(error: float) -> int:
    """Level of a pixel's first samples where an error is aimed at."""
    count, at = NODES
    return int(levels_of(np.clip(count * at / error, count, MOST)))
