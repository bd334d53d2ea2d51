"""Pixels and what is beside them: borders between shapes, outlines, and what is within reach."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import Labels
from renderer.math.arrays import Masks


def borders(labels: Labels) -> Masks:
    """Pixels one of whose eight neighbours shows another shape."""
    found = np.zeros(labels.shape, dtype=bool)
    across, along = labels[:, 1:] != labels[:, :-1], labels[1:] != labels[:-1]
    falling, rising = labels[1:, 1:] != labels[:-1, :-1], labels[1:, :-1] != labels[:-1, 1:]
    found[:, 1:] |= across
    found[:, :-1] |= across
    found[1:] |= along
    found[:-1] |= along
    found[1:, 1:] |= falling
    found[:-1, :-1] |= falling
    found[1:, :-1] |= rising
    found[:-1, 1:] |= rising
    return found


def outline(shape: tuple[int, ...]) -> Masks:
    """The outermost pixels of a picture: no neighbour shows an edge in the outer half of them."""
    found = np.ones(shape, dtype=bool)
    found[1:-1, 1:-1] = False
    return found


def highest(values: NDArray[np.float32], reach: int) -> NDArray[np.float32]:
    """Greatest of the values (H, W) up to `reach` away along and across."""
    height, width = values.shape
    padded = np.pad(values, reach, mode="edge")
    rows = np.maximum.reduce([padded[step : step + height] for step in range(2 * reach + 1)])
    greatest: NDArray[np.float32] = np.maximum.reduce(
        [rows[:, step : step + width] for step in range(2 * reach + 1)]
    )
    return greatest


def spread(marks: Masks, reach: int) -> Masks:
    """Marks (H, W) with all pixels up to `reach` away along and across."""
    height, width = marks.shape
    padded = np.pad(marks, reach)
    rows = np.logical_or.reduce([padded[step : step + height] for step in range(2 * reach + 1)])
    return np.logical_or.reduce([rows[:, step : step + width] for step in range(2 * reach + 1)])
