"""Pictures closer to their reference than its noise allows.

A reference of finitely many samples is noisy. The noise of a picture that was rendered independently does not
depend on it: at every pixel, the probability that the two are within a quarter of the reference's standard
error is bounded. In a copy of the reference nearly all pixels are that close.

The probability is 0.20 for normal noise. It is highest for samples of 0 or 1 where three in four pixels have
a single 1, as at the edge of a shadow: 0.68 with 16 samples, less with more. `MOST_NEAR` is above both, so
that Chernoff's inequality (1952) bounds the probability of a false alarm.
"""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import variances
from accuracy.comparison.blocks import BLOCK_SIDE
from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats, Masks

NEAR_STANDARD_ERRORS = 0.25
"""A pixel is near if it differs from the reference by at most so many standard errors."""

MOST_NEAR = 0.7
"""Largest probability that a pixel of an independent picture is near."""

FALSE_ALARM_PROBABILITY = 1e-6
"""Largest probability with which an independent picture is reported."""

LEAST_SAMPLES = 16
"""`MOST_NEAR` is a bound for references of at least so many samples."""

LEAST_GRAIN = 0.15
"""Least square of a second difference, relative to its expectation by the stated errors. A block counts only
if most of its squares reach it, as 70 % do in normal noise: dependent samples state too large errors."""

MOST_GRAIN = 2.0
"""Largest mean square of a block's second differences, relative to the same: edges make it larger."""

CLIPPED_STANDARD_ERRORS = 2.0
"""A pixel is left out if its value is within so many standard errors of 1: clipping may hide its noise."""


@dataclass(frozen=True, slots=True)
class Closeness:
    """Numbers of pixels that count, and that are near.

    Attributes
    ----------
    pixels : int
        Pixels whose noise is larger than rounding.
    near : int
        Pixels among these within `NEAR_STANDARD_ERRORS` of the reference.
    """

    pixels: int
    near: int

    @property
    def suspicious(self) -> bool:
        """Whether independent pictures are this close with at most `FALSE_ALARM_PROBABILITY`."""
        enough = -math.log(FALSE_ALARM_PROBABILITY)
        return self.pixels > 0 and self.pixels * _surprise(self.near / self.pixels) >= enough


def closeness(image: Picture, reference: Picture) -> Closeness | None:
    """Count the pixels of a picture that share the noise of its reference, both of one size.

    None unless the reference states its noise: it needs the layers ``error`` and ``samples``, and independent
    samples, as the pattern ``random`` draws them. Layers of the picture are ignored: they could be invented.
    """
    if not variances.known(reference):
        return None
    # One channel: the others come from the same samples, so they are no independent evidence.
    errors = (band.layers["error"].astype(np.float64) for band in reference.bands())
    channel = int(np.argmax(sum((error * error).sum(axis=(0, 1)) for error in errors)))
    both = zip(image.bands(), reference.bands(), strict=True)
    counts = [_counts(*band, channel) for band in both]
    return Closeness(*map(sum, zip(*counts, strict=True)))


def _counts(image: Picture, reference: Picture, channel: int) -> tuple[int, int]:
    """Number of pixels of a band that count, and of those that are near."""
    error, value, shown, rounding = (
        _blocks(part[:, :, channel].astype(np.float64))
        for part in (
            reference.layers["error"],
            reference.linear,
            image.linear,
            image.rounding + reference.rounding,
        )
    )
    usable = (
        (error > 0)
        & (rounding <= NEAR_STANDARD_ERRORS * error)
        & (value + CLIPPED_STANDARD_ERRORS * error < 1)
    )
    usable &= _as_stated(value, error)[:, :, None, None]
    usable &= _blocks(reference.layers["samples"]) >= LEAST_SAMPLES
    near = usable & (np.abs(shown - value) <= NEAR_STANDARD_ERRORS * error)
    return int(np.count_nonzero(usable)), int(np.count_nonzero(near))


def _blocks(values: Floats) -> Floats:
    """Pixels (H, W) in disjoint blocks, (rows, columns, 8, 8); incomplete blocks are left out."""
    rows, columns = values.shape[0] // BLOCK_SIDE, values.shape[1] // BLOCK_SIDE
    whole = values[: rows * BLOCK_SIDE, : columns * BLOCK_SIDE]
    return whole.reshape(rows, BLOCK_SIDE, columns, BLOCK_SIDE).swapaxes(1, 2)


def _as_stated(value: Floats, error: Floats) -> Masks:
    """Mask of blocks whose second differences are as large as the stated noise makes them."""
    squares, expected = _sums_of_three(value, -2) ** 2, _sums_of_three(error * error, 4)
    stated = expected > 0
    grainy = (stated & (squares >= LEAST_GRAIN * expected)).sum(axis=2)
    flat = squares.sum(axis=2) <= MOST_GRAIN * expected.sum(axis=2)
    counted = stated.sum(axis=2)
    return (counted > 0) & (2 * grainy >= counted) & flat


def _sums_of_three(values: Floats, middle: float) -> Floats:
    """First + `middle` times second + third of any three consecutive pixels of a row or column of a block.

    (rows, columns of blocks, 8, 8) -> (rows, columns of blocks, lines).
    """
    parts = []
    for axis in (2, 3):
        one, two, three = (np.take(values, range(start, start + BLOCK_SIDE - 2), axis) for start in range(3))
        parts.append((one + middle * two + three).reshape(*values.shape[:2], -1))
    return np.concatenate(parts, axis=2)


def _surprise(share: float) -> float:
    """Relative entropy of a share of near pixels to `MOST_NEAR`, nats; 0 for shares up to that.

    >>> _surprise(0.5), round(_surprise(1.0), 6)
    (0.0, 0.356675)
    """
    if share <= MOST_NEAR:
        return 0.0
    rest = (1 - share) * math.log((1 - share) / (1 - MOST_NEAR)) if share < 1 else 0.0
    return share * math.log(share / MOST_NEAR) + rest
