"""Operations on the neighbourhoods of pixels: borders between labels, dilation and local maxima."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import Labels
from renderer.math.arrays import Masks


def borders(labels: Labels) -> Masks:
    """Pixels one of whose eight neighbours has another label."""
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


def rim(shape: tuple[int, ...]) -> Masks:
    """Outermost pixels of a picture, (H, W)."""
    found = np.ones(shape, dtype=bool)
    found[1:-1, 1:-1] = False
    return found


def local_maximum(values: NDArray[np.float32], reach: int) -> NDArray[np.float32]:
    """Greatest of the values (H, W) within `reach` rows and columns."""
    height, width = values.shape
    padded = np.pad(values, reach, mode="edge")
    rows = np.maximum.reduce([padded[step : step + height] for step in range(2 * reach + 1)])
    greatest: NDArray[np.float32] = np.maximum.reduce(
        [rows[:, step : step + width] for step in range(2 * reach + 1)]
    )
    return greatest


def dilate(marks: Masks, reach: int) -> Masks:
    """Dilate a mask (H, W) by `reach` rows and columns."""
    height, width = marks.shape
    padded = np.pad(marks, reach)
    rows = np.logical_or.reduce([padded[step : step + height] for step in range(2 * reach + 1)])
    return np.logical_or.reduce([rows[:, step : step + width] for step in range(2 * reach + 1)])
