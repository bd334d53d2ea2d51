"""Detection of blurs: edges softer than the means of samples over each pixel make them.

A blur adds a multiple of the Laplacian to a picture: half of its variance, in squared pixels. The difference
from a reference is multiplied by the Laplacian, pixel by pixel. The sum of the products over its standard
error exceeds a limit at most as often as a standard normal number does: with the Laplacian of the picture,
independent noise of its pixels adds only what is below 0, and noise of the reference nothing. Where the noise
of the reference is known to be small, its own Laplacian serves, which shows more, less what its noise adds.
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
"""Least multiple of the Laplacian that is called a blur. Filters that renderers use for pixels, such as
tents 2 pixels wide (0.04) or Gaussians of 0.5 pixels (0.08), stay below; a Gaussian of 0.8 pixels after one
sample in the middle of each pixel has 0.28, means of 3 x 3 pixels 0.29."""

LEAST_FILTER = 0.03
"""Least multiple that is called a filter: means over each pixel's own square have none."""

MAX_NOISE_SHARE = 0.05
"""Share of the squared difference that the noise of a clean reference may have: with more, it would have to
be stated exactly."""

CENTRE_WEIGHT = 8 / 3
"""Weight of the central pixel in the Laplacian."""

WIDTHS = (0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0)
"""Standard deviations of the Gaussians that are tried, pixels."""

CUTOFF_DEVIATIONS = 3.0
"""Standard deviations at which a Gaussian is cut off."""


@dataclass(frozen=True, slots=True, eq=False)
class Blur:
    """A blur.

    Attributes
    ----------
    width : float
        Standard deviation of the Gaussian that comes nearest to it, pixels.
    effect : (H, W, 3) float64
        Difference of the blurred reference from the reference, linear.
    """

    width: float
    effect: Floats


def blur(image: Picture, reference: Picture, least: float = MIN_LAPLACIAN) -> Blur | None:
    """The blur of a picture; None if edges are as sharp as the reference's.

    `least` is the multiple of the Laplacian from which on it counts.
    """
    if not _is_softer(image, reference, least):
        return None
    wanted = reference.linear
    tried = (Blur(width, smoothed(wanted, width) - wanted) for width in WIDTHS)
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
        # The channels of a pixel come from the same samples: they are one witness.
        products = products.sum(axis=2)
        total, variance = total + float(products.sum()), variance + float(np.sum(products * products))
    return total > MIN_GAIN_ERRORS * math.sqrt(variance) and total > least * squares


def _is_clean(image: Picture, reference: Picture) -> bool:
    """Whether the noise of the reference is known to be small beside the difference."""
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
    """A picture (H, W, 3) after a Gaussian; what lies outside is as its outermost pixels."""
    reach = math.ceil(CUTOFF_DEVIATIONS * width)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        padding = [(reach, reach) if axis == each else (0, 0) for each in range(3)]
        padded = np.pad(values, padding, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, weights.size, axis=axis)
        values = np.asarray(windows @ weights)
    return values
