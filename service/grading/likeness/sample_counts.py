"""Estimated number of samples of a picture, where its reference states the noise of each pixel.

The squared differences of a picture of N random samples from a clean reference are the variances of one
sample over N, plus what rounding adds. Least squares give 1 / N as their slope. A picture made from the
reference has none, whatever noise was added to it evenly, in linear values or in codes; and noise where no
sample varies cannot come from samples.
"""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import variances
from accuracy.comparison.blocks import BLOCK_SIDE, gathered
from accuracy.comparison.inputs import Picture
from accuracy.comparison.noise import MIN_GRAIN, sample_variances, unlikeness
from renderer.math.arrays import Floats

MOST_SAMPLES = 1024
"""A picture that looks cleaner than so many samples was not rendered independently of its reference."""

LEAST_STANDARD_ERRORS = 5.0
"""Standard errors by which the slope must lie below that of `MOST_SAMPLES`: one in 3 million by chance."""

MOST_PIXELS = 1 << 19
"""Pixels of a picture that are read, about: more would not make a slope of 0 more certain."""

LEAST_PIXELS = 200
"""The count is unknown with fewer pixels noisier than rounding."""

ABOVE_ROUNDING = 16.0
"""Deviation of a sample over the rounding of the files, from which on a pixel counts as noisy."""

LEAST_SPREAD = 0.01
"""Share of the squared variances that must differ from pixel to pixel, or no slope is seen."""

LEAST_NOISE = 1.5
"""Deviation of noise that is more than rounding, over the largest error of rounding: its own is 0.6."""

MOST_GRAINY = 0.1
"""Share of the blocks where no sample varies that may have grain: thin lines in wrong places look like it."""

LEAST_BLOCKS = 8
"""Grain in fewer blocks is not suspicious."""


@dataclass(frozen=True, slots=True)
class SampleCount:
    """The slope of the squared differences.

    Attributes
    ----------
    slope : float
        1 over the number of random samples that the noise looks like; about 0 for none.
    error : float
        Its standard error.
    """

    slope: float
    error: float

    @property
    def suspicious(self) -> bool:
        """Whether the picture is cleaner than `MOST_SAMPLES` random samples make it."""
        return self.slope + LEAST_STANDARD_ERRORS * self.error < 1 / MOST_SAMPLES


def sample_count(image: Picture, reference: Picture) -> SampleCount | None:
    """The samples that a picture's noise looks like; None where too little noise is known or visible."""
    if not variances.known(reference):
        return None
    # One channel: those of a pixel come from the same samples and are no further witnesses.
    channel = int(np.argmax(sum(sample_variances(band).sum(axis=(0, 1)) for band in reference.bands())))
    # Of large pictures some rows are enough.
    kept = slice(None, None, math.ceil(image.width * image.height / MOST_PIXELS))
    shown, value = (
        each.pixels.part(kept, slice(None), slice(channel, channel + 1)) for each in (image, reference)
    )
    error = reference.layers["error"][kept, :, channel].astype(np.float64)
    single = (error * error * reference.layers["samples"][kept]).ravel()
    rounding = (shown.rounding + value.rounding).ravel()
    difference = (shown.linear - value.linear).ravel()
    if np.count_nonzero(single > (ABOVE_ROUNDING * rounding) ** 2) < LEAST_PIXELS:
        return None
    return _slope(single, difference * difference, rounding * rounding)


def _slope(x: Floats, y: Floats, other: Floats) -> SampleCount | None:
    """The slope of y over x beside a constant and `other`; None where these explain x.

    Its standard error is that of White (1980), which takes any scatter.
    """
    whole = float(np.sum(x * x))
    basis = np.stack((np.ones_like(x), other / other.max()), axis=1)
    x, y = (values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0] for values in (x, y))
    squares = float(np.sum(x * x))
    if squares < LEAST_SPREAD * whole:
        return None
    slope = float(np.sum(x * y)) / squares
    rest = x * (y - slope * x)
    return SampleCount(slope, math.sqrt(float(np.sum(rest * rest))) / squares)


@dataclass(frozen=True, slots=True)
class Grain:
    """Noise where random samples make none.

    Attributes
    ----------
    blocks : int
        Blocks of 8 x 8 pixels in which no sample varies by more than rounding.
    grainy : int
        Those of them with noise.
    """

    blocks: int
    grainy: int

    @property
    def suspicious(self) -> bool:
        """Whether there is so much of it that it cannot be a few displaced lines."""
        return self.grainy >= max(LEAST_BLOCKS, MOST_GRAINY * self.blocks)


def grain(image: Picture, reference: Picture, tolerance: float) -> Grain | None:
    """Count blocks with noise where no sample varies; None where the noise of the reference is not known.

    Parameters
    ----------
    tolerance
        Noise whose deviation is below a quarter of it does not count.
    """
    if not variances.known(reference) or min(image.width, image.height) < BLOCK_SIDE:
        return None
    both = zip(image.bands(), reference.bands(), strict=True)
    counts = [_grain(*band, tolerance) for band in both]
    return Grain(*map(sum, zip(*counts, strict=True)))


def _grain(image: Picture, reference: Picture, tolerance: float) -> tuple[int, int]:
    """Blocks of a band in which no sample varies, and how many of these have noise."""
    single = sample_variances(reference)
    quiet = np.maximum(gathered(image.rounding + reference.rounding).max(axis=2), tolerance / 4)
    still = (gathered(single).max(axis=2) <= quiet * quiet).all(axis=2)
    difference = gathered(image.linear - reference.linear)
    loud = difference.var(axis=2) > (LEAST_NOISE * quiet) ** 2
    grainy = still & (loud & (unlikeness(difference, image.linear.shape) >= MIN_GRAIN)).any(axis=2)
    return int(np.count_nonzero(still)), int(np.count_nonzero(grainy))
