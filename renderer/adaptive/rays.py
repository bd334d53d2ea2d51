"""Camera rays through scattered pixels, and labels of their hits.

A label is a shape's number, -1 for the background, -2 and below for lights, as int32 in maps of the picture.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import EMITTER, MISS, Rays
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.plan import RenderPlan

Labels = NDArray[np.int32]
"""(H, W) int32."""


def camera_rays(
    plan: RenderPlan, columns: Integers, rows: Integers, samples: Integers, place: tuple[Floats, Floats]
) -> Rays:
    """Rays of samples (n,) through pixels (n,), at two coordinates (n,) within them."""
    pixels = plan.camera.numbers(columns, rows)
    origins, directions = plan.camera.rays(columns + place[0], rows + place[1], pixels, samples)
    bounds = plan.camera.bounds(columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    return Rays(origins, directions, pixels, samples, screen=bounds)


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
