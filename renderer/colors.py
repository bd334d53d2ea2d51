"""Encodings of colour."""

import numpy as np
from numpy.typing import NDArray


def linear_from_srgb(encoded: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear values of sRGB codes in 0..1 (IEC 61966-2-1), float32 with an error of 2 spacings."""
    x = encoded.astype(np.float64)
    low = x / 12.92
    high = ((np.maximum(x, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(x <= 0.04045, low, high).astype(np.float32)


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """SRGB codes in 0..1 of linear values in 0..1 (IEC 61966-2-1).

    The power sees no value below the toe, so that no negative number reaches it.
    """
    x = linear.astype(np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)
