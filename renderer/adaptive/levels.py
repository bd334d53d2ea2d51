"""How many camera samples a pixel has been given: a level, a number small enough for a map of the picture.

Level 0 is none: the pixel's value is interpolated. Level 1 is one ray through its middle, the first look,
which counts no more when samples follow. Level n from 2 on is 2**n samples in two halves that know nothing
of each other.
"""

import numpy as np
from numpy.typing import NDArray

Levels = NDArray[np.uint8]
"""(H, W) uint8."""

UNSEEN, LOOKED, SAMPLED = 0, 1, 2
"""Level of an interpolated pixel, of one with a first look, and the first one with samples."""

HIGHEST = 16
"""65,536 samples, the most that fixed quality takes as well."""


def samples_of(level: int) -> int:
    """Camera samples at a level, without the first look."""
    return 1 << level if level >= SAMPLED else 0
