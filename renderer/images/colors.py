"""Encodings of colour."""

import numpy as np
from numpy.typing import NDArray

BAND_VALUES = 1 << 20
"""Values that are converted at once."""


def linear_from_srgb(encoded: NDArray[np.floating]) -> NDArray[np.float32]:
    """Linear values of sRGB codes in 0..1 (IEC 61966-2-1), float32 with an error of 2 spacings."""
    linear = np.empty(encoded.shape, dtype=np.float32)
    # Textures are large: what is in double precision at once is small.
    flat, filled = encoded.reshape(-1), linear.reshape(-1)
    for start in range(0, flat.size, BAND_VALUES):
        x = flat[start : start + BAND_VALUES].astype(np.float64)
        low = x / 12.92
        high = ((x + 0.055) / 1.055) ** 2.4
        filled[start : start + BAND_VALUES] = np.where(x <= 0.04045, low, high)
    return linear


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """SRGB codes in 0..1 of linear values in 0..1 (IEC 61966-2-1).

    Both branches are evaluated everywhere: a value below 0 would be NaN in the power.
    """
    x = linear.astype(np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
