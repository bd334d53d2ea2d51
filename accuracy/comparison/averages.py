"""Means of samples that were encoded for the display first, predicted from a right picture and its noise."""

import numpy as np

from accuracy.comparison.inputs import Picture
from accuracy.comparison.neighbours import neighbourhood
from accuracy.comparison.noise import sample_variances
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats


def averaged_encoded(reference: Picture) -> Floats:
    """A reference whose errors are `known` as means of encoded samples show it, linear (H, W, 3).

    Samples are taken to have two values with the mean and variance of the pixel. The brighter one is that of
    the brightest pixel around, as at an edge, or one deviation above the mean, as in a penumbra.
    """
    mean, variance = reference.linear, sample_variances(reference)
    bright = np.minimum(np.maximum(neighbourhood(mean)[1], mean + np.sqrt(variance)), 1)
    above = np.maximum(bright - mean, 1e-9)
    dark = np.clip(mean - variance / above, 0, 1)
    share = (mean - dark) / np.maximum(bright - dark, 1e-9)
    codes = share * srgb_from_linear(bright) + (1 - share) * srgb_from_linear(dark)
    return np.where(variance > 0, linear_from_srgb(np.clip(codes, 0, 1)), mean)
