"""What a ray hit, small enough for a map of the picture.

A label is a shape's number, -1 for the background, -2 and below for lights.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import EMITTER
from renderer.math.arrays import Integers, Masks

Labels = NDArray[np.int32]
"""(H, W) int32."""


def labels_of(shapes: Integers) -> NDArray[np.int32]:
    """Labels (n,) of the shape numbers of rays."""
    return np.where(shapes >= EMITTER, EMITTER - 2 - shapes, shapes).astype(np.int32)


def of_labels(shapes: Masks, labels: NDArray[np.int32]) -> Masks:
    """What a mask of the scene's shapes says of labels, False where they show no shape."""
    if not shapes.any():
        return np.zeros(labels.shape, dtype=bool)
    return np.take(np.append(False, shapes), labels + 1, mode="clip")
