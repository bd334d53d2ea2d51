"""Culling of occluders that cannot stand between a chunk of points and a light.

Every test is conservative: a culled occluder blocks no pair, rounding included, so images are bitwise the
same with and without.
"""

import numpy as np

from renderer.accelerators.boxes import Boxes
from renderer.lights.emitters import Emitter
from renderer.math.arrays import Floats, Masks

SHAFT_MARGIN = 2.0**-18
"""Relative margin around the shaft. Pair work in float32 moves an occluder's edge by some 2**-21 of it."""


def bounds(positions: Floats) -> tuple[Floats, Floats]:
    """Least and greatest coordinates of points (3, n), (3, 1) each."""
    return positions.min(axis=1, keepdims=True), positions.max(axis=1, keepdims=True)


def shaft(boxes: Boxes, low: Floats, high: Floats, emitter: Emitter) -> Masks:
    """Boxes that overlap the bounds of all segments to the light from points between low and high, (K,)."""
    if emitter.weight == 0:
        low = np.where(emitter.centre < 0, -np.inf, low)
        high = np.where(emitter.centre > 0, np.inf, high)
    else:
        ends = emitter.ends()
        low = np.minimum(low, ends.min(axis=1, keepdims=True))
        high = np.maximum(high, ends.max(axis=1, keepdims=True))
    finite = np.where(np.isfinite(low), np.abs(low), 0) + np.where(np.isfinite(high), np.abs(high), 0)
    slack = SHAFT_MARGIN * (finite.max() + np.maximum(np.abs(boxes.low), np.abs(boxes.high)))
    return np.all((boxes.low <= high + slack) & (boxes.high >= low - slack), axis=0)
