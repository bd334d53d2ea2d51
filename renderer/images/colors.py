"""Encodings of colour."""

import numpy as np
from numpy.typing import NDArray


def linear_from_srgb(encoded: NDArray[np.floating]) -> NDArray[np.float32]:
    """Linear values of sRGB codes in 0..1 (IEC 61966-2-1), float32 with an error of 2 spacings."""
    x = encoded.astype(np.float64)
    low = x / 12.92
    high = ((x + 0.055) / 1.055) ** 2.4
    return np.where(x <= 0.04045, low, high).astype(np.float32)


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """SRGB codes in 0..1 of linear values in 0..1 (IEC 61966-2-1).

    Both branches are evaluated everywhere: a value below 0 would be NaN in the power.
    """
    x = linear.astype(np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
