"""Levels: the logarithm of a pixel's number of camera samples, small enough for a map of the picture.

Level 0 is none: the pixel's value is interpolated. Level 1 is one ray through its centre, the pilot sample.
Level 2 is a border pixel with measured coverage (`coverage`). Level n from 3 on is 2**(n - 1) samples in two
independent halves.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats, Integers

Levels = NDArray[np.uint8]
"""(H, W) uint8."""

PREVIEWED, COVERED, SAMPLED = 1, 2, 3
"""Levels of a pilot sample and of a border pixel, and the first level with samples."""

HIGHEST = 17
"""65,536 samples: fixed quality accepts no more either."""

COUNTS = np.array([0, 0, 0, *(1 << level - 1 for level in range(SAMPLED, HIGHEST + 1))], dtype=np.int64)
"""Camera samples at each level, without those of pilot samples."""

FIBONACCI = [2, 3]
"""Rays in each of the two lattices that measure the coverage of a border pixel."""

while (following := FIBONACCI[-2] + FIBONACCI[-1]) <= COUNTS[HIGHEST] // 2:
    FIBONACCI.append(following)

COVERAGES = np.array([0, *(2 * count for count in FIBONACCI)], dtype=np.int64)
"""Rays of both lattices, by the number stored in maps."""

RAY_PRICE = 1 / 12
"""CPU time of an unshaded ray over that of a camera sample, on `soft` and `chess`."""


def levels_of(counts: Floats) -> Integers:
    """Levels nearest to numbers of samples, by the logarithm."""
    levels = np.rint(np.log2(np.maximum(counts, 1))) + 1
    return np.clip(levels, SAMPLED, HIGHEST).astype(np.int64)


FIRST_SAMPLES = 8, 4 / 255
"""Samples of a new node, and the error for which they suffice; in inverse proportion for smaller errors."""

MAX_FIRST_SAMPLES = 128
"""Most samples of a new node, from which its further need is known."""


def node_level(error: float) -> int:
    """Level of a pixel's first samples for an error aimed at."""
    count, at = FIRST_SAMPLES
    return int(levels_of(np.clip(count * at / error, count, MAX_FIRST_SAMPLES)))
