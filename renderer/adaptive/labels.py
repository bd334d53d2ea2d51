"""Labels of the hits of camera rays, their borders, and operations on the neighbourhoods of pixels.

A label is a shape's number, -1 for the background, -2 and below for lights, as int32 in maps of the picture.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import EMITTER, MISS
from renderer.math.arrays import Integers, Masks

Labels = NDArray[np.int32]
"""(H, W) int32."""


def labels_of(shapes: Integers) -> NDArray[np.int32]:
    """Labels (n,) of the shape numbers that rays have hit."""
    return np.where(shapes >= EMITTER, EMITTER - 2 - shapes, shapes).astype(np.int32)


def of_lights(labels: NDArray[np.int32]) -> Masks:
    """Mask of labels of lights."""
    return np.asarray(labels < MISS)


def of_labels(shapes: Masks, labels: NDArray[np.int32]) -> Masks:
    """Mask of labels whose shape is in a mask `shapes` (K,)."""
    if not shapes.any():
        return np.zeros(labels.shape, dtype=bool)
    return np.take(np.append(False, shapes), labels + 1, mode="clip")


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
