"""Detection of blurs: edges softer than averaging over each pixel makes them.

A blur adds a multiple of the Laplacian to a picture: half of its variance, in squared pixels. It is estimated
from the products of Laplacian and difference. Their sum over its standard error exceeds a limit at most as
often as a standard normal number does: independent noise of the picture makes the products with its own
Laplacian negative in the mean, and noise of the reference adds nothing. If the noise of the reference is
known to be small, its Laplacian is used, which detects more, and the part due to its noise is subtracted.
"""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import variances
from accuracy.comparison.inputs import Picture
from accuracy.comparison.pixels import bordered_bands
from renderer.math.arrays import Floats

MIN_GAIN_ERRORS = 5.0
"""Standard errors: one false alarm in 3 million pictures."""

MIN_LAPLACIAN = 0.1
"""Least multiple of the Laplacian that counts as a blur. Pixel filters of renderers stay below: a tent 2
pixels wide has 0.04, a Gaussian of 0.5 pixels 0.08. A Gaussian of 0.8 pixels after one sample in the middle
of each pixel has 0.28, means of 3 x 3 pixels 0.29."""

LEAST_FILTER = 0.03
"""Least multiple that counts as a filter: means over each pixel's own square have none."""

MAX_NOISE_SHARE = 0.05
"""Share of the squared difference that noise of a clean reference may cause: more would have to be stated
exactly."""

CENTRE_WEIGHT = 8 / 3
"""Weight of the central pixel in the Laplacian."""

GAUSSIAN_WIDTHS = (0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0)
"""Standard deviations of the Gaussians that are tried, pixels."""

CUTOFF_DEVIATIONS = 3.0
"""Standard deviations at which a Gaussian is cut off."""


@dataclass(frozen=True, slots=True, eq=False)
class Blur:
    """A blur.

    Attributes
    ----------
    width : float
        Standard deviation of the nearest Gaussian, pixels.
    effect : (H, W, 3) float64
        Difference of the blurred reference from the reference, linear.
    """

    width: float
    effect: Floats


def blur(image: Picture, reference: Picture, least: float = MIN_LAPLACIAN) -> Blur | None:
    """The blur of a picture; None if edges are as sharp as the reference's.

    `least` is the least multiple of the Laplacian that counts.
    """
    if not _is_softer(image, reference, least):
        return None
    wanted = reference.linear
    tried = (Blur(width, smoothed(wanted, width) - wanted) for width in GAUSSIAN_WIDTHS)
    return min(tried, key=lambda each: float(np.sum((image.linear - wanted - each.effect) ** 2)))


def _is_softer(image: Picture, reference: Picture, least: float) -> bool:
    clean = _is_clean(image, reference)
    total = variance = squares = 0.0
    for rows in bordered_bands(image.height, image.width):
        one, other = image.part(rows), reference.part(rows)
        laplacian = _laplacian((other if clean else one).linear)
        products = (one.linear - other.linear)[1:-1, 1:-1] * laplacian
        if clean:
            products -= CENTRE_WEIGHT * other.layers["error"][1:-1, 1:-1].astype(np.float64) ** 2
        squares += float(np.sum(laplacian * laplacian))
        # The channels of a pixel come from the same samples: they are one piece of evidence.
        products = products.sum(axis=2)
        total, variance = total + float(products.sum()), variance + float(np.sum(products * products))
    return total > MIN_GAIN_ERRORS * math.sqrt(variance) and total > least * squares


def _is_clean(image: Picture, reference: Picture) -> bool:
    """Whether the reference states noise that is small compared with the difference."""
    if not variances.known(reference):
        return False
    both = zip(image.bands(), reference.bands(), strict=True)
    sums = [
        (np.sum(b.layers["error"].astype(np.float64) ** 2), np.sum((a.linear - b.linear) ** 2))
        for a, b in both
    ]
    noise, difference = np.sum(sums, axis=0)
    return bool(noise < MAX_NOISE_SHARE * difference)


def _laplacian(values: Floats) -> Floats:
    """Second derivatives in x and y of (H, W, 3), summed, for all but the outermost pixels.

    Three times the mean of 3 x 3 pixels less the middle: their variance is 2/3 along both axes.
    """
    rows = values[:-2] + values[1:-1] + values[2:]
    squares = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]
    return np.asarray(squares / 3 - 3 * values[1:-1, 1:-1])


def smoothed(values: Floats, width: float) -> Floats:
    """A picture (H, W, 3) after a Gaussian; its outermost pixels continue outside."""
    reach = math.ceil(CUTOFF_DEVIATIONS * width)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        padding = [(reach, reach) if axis == each else (0, 0) for each in range(3)]
        padded = np.pad(values, padding, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, weights.size, axis=axis)
        values = np.asarray(windows @ weights)
    return values
