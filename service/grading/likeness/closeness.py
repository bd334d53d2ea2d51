"""Whether a picture lies closer to its reference than the noise of the reference allows.

A reference of finitely many samples misses the truth by its noise. A correct picture that was made without
it knows nothing of that noise: whatever value it has at a pixel, the reference falls within a quarter of its
standard error of that value with a probability that is bounded, independently of all other pixels. A picture
that was made from the reference is there nearly everywhere.

The probability is 0.20 for normal noise. It is highest where a sample says yes or no and three in four
pixels have one yes among all, as at the rim of a shadow: 0.68 with 16 samples, less with more. `BOUND` is
above both, so that Chernoff's inequality (1952) bounds the probability of a false alarm.
"""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import variances
from accuracy.comparison.blocks import BLOCK_SIDE
from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats, Masks

NEAR = 0.25
"""Standard errors within which a pixel counts as near."""

BOUND = 0.7
"""Probability with which a pixel of a picture of its own is near, at most."""

LEVEL = 1e-6
"""Probability of a false alarm, at most."""

FEWEST = 16
"""Samples of the reference from which on `BOUND` holds."""

LEAST_GRAIN = 0.15
"""Of the square that its stated errors let a second difference expect: a block counts only if most of its
own have as much, as 70 % of normal noise do. Samples that were not independent err less than they say."""

MOST_GRAIN = 2.0
"""And only if their mean square is at most this many times what is expected: edges make it larger."""

CLIPPED = 2.0
"""Standard errors below 1 from where on clipping may have hidden a pixel's noise."""


@dataclass(frozen=True, slots=True)
class Closeness:
    """Result of counting.

    Attributes
    ----------
    pixels : int
        Pixels whose noise is larger than rounding.
    near : int
        Those of them within `NEAR` standard errors of the reference.
    """

    pixels: int
    near: int

    @property
    def suspicious(self) -> bool:
        """Whether a picture of its own is so close with a probability of at most `LEVEL`."""
        return self.pixels > 0 and self.pixels * _surprise(self.near / self.pixels) >= -math.log(LEVEL)


def closeness(image: Picture, reference: Picture) -> Closeness | None:
    """Count the pixels of a picture that share the noise of its reference, both of one size.

    None where the noise of the reference is not known: it needs the layers ``error`` and ``samples``, and its
    samples must be independent, which the pattern ``random`` makes them. What the picture states of its own
    noise is not used: it could be invented.
    """
    if not variances.known(reference):
        return None
    # One channel: those of a pixel come from the same samples and are no further witnesses.
    errors = (band.layers["error"].astype(np.float64) for band in reference.bands())
    channel = int(np.argmax(sum((error * error).sum(axis=(0, 1)) for error in errors)))
    both = zip(image.bands(), reference.bands(), strict=True)
    counts = [_counts(*band, channel) for band in both]
    return Closeness(*map(sum, zip(*counts, strict=True)))


def _counts(image: Picture, reference: Picture, channel: int) -> tuple[int, int]:
    """Pixels of a band that count, and how many of these are near."""
    error, value, shown, rounding = (
        _blocks(part[:, :, channel].astype(np.float64))
        for part in (
            reference.layers["error"],
            reference.linear,
            image.linear,
            image.rounding + reference.rounding,
        )
    )
    usable = (error > 0) & (rounding <= NEAR * error) & (value + CLIPPED * error < 1)
    usable &= _as_stated(value, error)[:, :, None, None]
    usable &= _blocks(reference.layers["samples"]) >= FEWEST
    near = usable & (np.abs(shown - value) <= NEAR * error)
    return int(np.count_nonzero(usable)), int(np.count_nonzero(near))


def _blocks(values: Floats) -> Floats:
    """Pixels (H, W) in blocks, (rows, columns, 8, 8), each once; what fills no block is left out."""
    rows, columns = values.shape[0] // BLOCK_SIDE, values.shape[1] // BLOCK_SIDE
    whole = values[: rows * BLOCK_SIDE, : columns * BLOCK_SIDE]
    return whole.reshape(rows, BLOCK_SIDE, columns, BLOCK_SIDE).swapaxes(1, 2)


def _as_stated(value: Floats, error: Floats) -> Masks:
    """Blocks of which the second differences are those of noise as large as stated."""
    # Second differences, and by the errors of their three pixels what their squares are expected to be.
    squares, expected = _sums_of_three(value, -2) ** 2, _sums_of_three(error * error, 4)
    stated = expected > 0
    grainy = (stated & (squares >= LEAST_GRAIN * expected)).sum(axis=2)
    flat = squares.sum(axis=2) <= MOST_GRAIN * expected.sum(axis=2)
    counted = stated.sum(axis=2)
    return (counted > 0) & (2 * grainy >= counted) & flat


def _sums_of_three(values: Floats, middle: float) -> Floats:
    """Of each three pixels in a row or column of a block, the first + `middle` times the second + the third.

    (rows, columns of blocks, 8, 8) -> (rows, columns of blocks, lines).
    """
    parts = []
    for axis in (2, 3):
        one, two, three = (np.take(values, range(start, start + BLOCK_SIDE - 2), axis) for start in range(3))
        parts.append((one + middle * two + three).reshape(*values.shape[:2], -1))
    return np.concatenate(parts, axis=2)


def _surprise(share: float) -> float:
    """Relative entropy of a share of near pixels to `BOUND`, nats; 0 for shares that are no surprise.

    >>> _surprise(0.5), round(_surprise(1.0), 6)
    (0.0, 0.356675)
    """
    if share <= BOUND:
        return 0.0
    rest = (1 - share) * math.log((1 - share) / (1 - BOUND)) if share < 1 else 0.0
    return share * math.log(share / BOUND) + rest
