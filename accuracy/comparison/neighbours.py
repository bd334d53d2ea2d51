"""Minimum and maximum over a pixel and its neighbours."""

import numpy as np

from renderer.math.arrays import Floats


def neighbourhood(values: Floats) -> tuple[Floats, Floats]:
    """Least and largest of each pixel and its eight neighbours, (H, W, ...) -> two of the same shape."""
    return _extreme(values, np.minimum), _extreme(values, np.maximum)


def _extreme(values: Floats, chosen: np.ufunc) -> Floats:
    tall = values.copy()
    chosen(tall[1:], values[:-1], out=tall[1:])
    chosen(tall[:-1], values[1:], out=tall[:-1])
    wide = tall.copy()
    chosen(wide[:, 1:], tall[:, :-1], out=wide[:, 1:])
    chosen(wide[:, :-1], tall[:, 1:], out=wide[:, :-1])
    return wide
