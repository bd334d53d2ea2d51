"""Pixels and what is beside them."""

import numpy as np

from renderer.arrays import Masks


def outline(shape: tuple[int, ...]) -> Masks:
    """The outermost pixels of a picture: no neighbour tells of an edge in the outer half of them."""
    found = np.ones(shape, dtype=bool)
    found[1:-1, 1:-1] = False
    return found


def spread(marks: Masks, reach: int) -> Masks:
    """Marks (H, W) with all pixels up to `reach` away along and across."""
    height, width = marks.shape
    padded = np.pad(marks, reach)
    rows = np.logical_or.reduce([padded[step : step + height] for step in range(2 * reach + 1)])
    return np.logical_or.reduce([rows[:, step : step + width] for step in range(2 * reach + 1)])
