"""Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004) of what is seen, with its own window."""

import numpy as np

from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats

SIDE, SIGMA = 11, 1.5
"""The window of the paper: a Gaussian of 11 x 11 pixels with standard deviation 1.5, which adds up to 1."""

STABILITY = (0.01**2, 0.03**2)
"""C1 and C2 of the paper for values 0..1."""

LUMA = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue (ITU-R BT.709), applied to sRGB codes."""


def luma(linear: Floats) -> Floats:
    """Brightness as seen of a linear picture (H, W, 3) with values 0..1: (H, W), 0 to 1."""
    seen = srgb_from_linear(linear)
    return seen[:, :, 0] * LUMA[0] + seen[:, :, 1] * LUMA[1] + seen[:, :, 2] * LUMA[2]


def ssim(image: Floats, reference: Floats) -> float | None:
    """Mean structural similarity of two pictures (H, W), values 0..1; at most 1, which means equal.

    Variances are those of the window's population. Only windows that lie whole in the picture count: their
    centres keep 5 pixels from each border. None for pictures with fewer than 11 pixels along a side.
    """
    if min(image.shape) < SIDE:
        return None
    mean_a, mean_b = _windowed(image), _windowed(reference)
    squares, product = mean_a * mean_a + mean_b * mean_b, mean_a * mean_b
    # The formula has the variances in their sum alone.
    variances = _windowed(image * image + reference * reference) - squares
    covariance = _windowed(image * reference) - product
    c1, c2 = STABILITY
    above = (2 * product + c1) * (2 * covariance + c2)
    below = (squares + c1) * (variances + c2)
    return float((above / below).mean())


def window() -> Floats:
    """One side of the window, (11,); the window is its outer product with itself."""
    away = np.arange(SIDE) - SIDE // 2
    weights = np.exp(-(away * away) / (2 * SIGMA * SIGMA))
    return weights / weights.sum()


def _windowed(values: Floats) -> Floats:
    """Weighted means over all whole windows, (H, W) -> (H - 10, W - 10)."""
    return _along(_along(values, window()).T, window()).T


def _along(values: Floats, weights: Floats) -> Floats:
    rows = values.shape[0] - SIDE + 1
    half = SIDE // 2
    total = values[half : half + rows] * weights[half]
    # The window is symmetric: rows at the same distance share a weight.
    for step in range(half):
        mirrored = SIDE - 1 - step
        total += (values[step : step + rows] + values[mirrored : mirrored + rows]) * weights[step]
    return total
