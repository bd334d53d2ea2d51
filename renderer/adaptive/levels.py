"""How many camera samples a pixel has been given: a level, a number small enough for a map of the picture.

Level 0 is none: the pixel's value is interpolated. Level 1 is one ray through its middle, the first look,
which counts no more when samples take its place. Level n from 2 on is 2**n samples in two halves that know
nothing of each other.
"""

import numpy as np
from numpy.typing import NDArray

Levels = NDArray[np.uint8]
"""(H, W) uint8."""

LOOKED, SAMPLED = 1, 2
"""Level of a pixel with a first look, and the first level with samples."""

HIGHEST = 16
"""65,536 samples, the most that fixed quality takes as well."""

COUNTS = np.array([0, 0, *(1 << level for level in range(SAMPLED, HIGHEST + 1))], dtype=np.int64)
"""Camera samples at each level, without the first look."""
