"""Rectangles in their two forms, as other renderers want them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from schemas.lights import ParallelogramLight, RectangleLight
from schemas.shapes import Parallelogram, Rectangle

if TYPE_CHECKING:
    from numpy.typing import NDArray


def corner_and_edges(
    rectangle: Rectangle | Parallelogram | RectangleLight | ParallelogramLight,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Write both forms of a rectangle as corner, first edge and second edge, each of shape (3,)."""
    if isinstance(rectangle, Parallelogram | ParallelogramLight):
        first, second = np.array(rectangle.edges)
        return np.array(rectangle.corner), first, second
    normal = np.array(rectangle.normal) / np.linalg.norm(rectangle.normal)
    tangent = np.array(rectangle.tangent) - np.dot(rectangle.tangent, normal) * normal
    tangent /= np.linalg.norm(tangent)
    first, second = rectangle.size[0] * tangent, rectangle.size[1] * np.cross(normal, tangent)
    return np.array(rectangle.center) - first / 2 - second / 2, first, second
