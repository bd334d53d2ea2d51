"""Formulas for ellipsoids as textbooks have them, to count what they get wrong.

All work in the dtype of the arrays that they are given.
"""

from typing import Any

import numpy as np

from renderer.math.arrays import Masks, Pairs


def quadratic(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """Distances (N,) of rays (N, 3): b^2 - 4ac of the ray brought to the unit sphere by one 4x4 matrix.

    inf for a miss.
    """
    roots, missed = _roots(shape, origins, directions)
    return _nearest(roots, missed)


def boxed_quadratic(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """The same, after a test of the box that takes a component of -0 for one of 0 (Smits 1998)."""
    middle, axes = _parts(shape, origins.dtype)
    reach = np.sqrt((axes * axes).sum(axis=0))
    first, second = (middle - reach - origins) / directions, (middle + reach - origins) / directions
    forward = directions >= 0
    near, far = np.where(forward, first, second).max(axis=1), np.where(forward, second, first).min(axis=1)
    return np.where(near > far, np.inf, quadratic(shape, origins, directions))


def _parts(shape: Any, dtype: np.dtype[Any]) -> tuple[Pairs, Pairs]:
    """Centre (3,) and semi-axes, one a row."""
    axes = shape.axes if hasattr(shape, "axes") else np.eye(3) * shape.radius
    return np.array(shape.center, dtype=dtype), np.array(axes, dtype=dtype)


def _inverse(axes: Pairs) -> Pairs:
    return axes / (axes * axes).sum(axis=1)[:, None]


def _roots(shape: Any, origins: Pairs, directions: Pairs) -> tuple[tuple[Pairs, Pairs], Masks]:
    middle, axes = _parts(shape, origins.dtype)
    rows = _inverse(axes)
    o, d = origins @ rows.T - rows @ middle, directions @ rows.T
    a, b, c = (d * d).sum(axis=1), 2 * (o * d).sum(axis=1), (o * o).sum(axis=1) - 1
    root = np.sqrt(b * b - 4 * a * c)
    return ((-b - root) / (2 * a), (-b + root) / (2 * a)), b * b - 4 * a * c < 0


def _nearest(roots: tuple[Pairs, Pairs], missed: Masks) -> Pairs:
    first, second = roots
    t = np.where(first > 0, first, second)
    return np.where(missed | (t <= 0), np.inf, t)
