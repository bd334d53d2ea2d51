"""Pictures of one scene that share their noise, found among those of a class in one pass.

Two programs that draw their own random numbers make pictures whose noise is independent, even if both are
right or both make the same mistake. So each picture is reduced to its finest detail: diagonal differences of
2 x 2 pixels, less those of the reference, which suppress smooth mistakes and straight edges. They count only
where the class shows noise. The median over all pictures is common to them, the median deviation from it is
the noise of a 2 x 2, and a picture that deviates much further shows a mistake there. The rest correlates only
if one picture was made from the other, or if both programs use the same samples.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats, Masks

FEWEST_PICTURES = 10
"""Medians over fewer pictures are too noisy."""

FEWEST_PLACES = 100
"""Two pictures are compared in at least so many noisy places."""

DEVIATION_OVER_MAD = 1.4826
"""The standard deviation of normal noise over its median absolute deviation."""

MEDIAN_VARIANCE = math.pi / 2
"""The variance of the median of normal numbers, times their count, over their own variance."""

ABOVE_ROUNDING = 3.0
"""A place counts only if the noise of the class is so many standard deviations of rounding there."""

OWN_ABOVE_ROUNDING = 1.5
"""The same for the noise of a picture alone: with less noise, pictures of many samples are rounded alike."""

ABOVE_MEDIAN = 4.0
"""Least variance of a picture, relative to that of the median: all pictures share the median's noise, which
alone makes them correlate by up to the inverse of this."""

MOST_DEVIATIONS = 3.5
"""A difference of more standard deviations is a mistake; normal noise reaches it once in 2000 places."""

MOST_FAR = 0.2
"""A picture with mistakes in a larger share of the noisy places is not compared."""

MOST_NOISE = 1.6
"""Nor is one whose noise exceeds that of the class by this factor."""

LEAST_CORRELATION = 0.5
"""Least correlation of pictures that share their noise. Two that share a mistake may reach 0.7, because some
of it remains at edges, so `MOST_DIFFERENCE` must hold too."""

MOST_DIFFERENCE = 0.3
"""Largest variance of the difference of two pictures that share their noise, relative to other pairs."""

LEAST_STANDARD_ERRORS = 8.0
"""A correlation exceeds 0 by at least so many standard errors; chance does that once in 10^15 pairs."""


@dataclass(frozen=True, slots=True, eq=False)
class Fingerprint:
    """The finest detail of a picture that its reference lacks, a number for each 2 x 2 pixels.

    Attributes
    ----------
    detail : (rows, columns) float16
        Diagonal differences of the linear mean of the channels.
    rounding : (rows, columns) float16
        Their standard deviation if only the file's codes were rounded.
    """

    detail: NDArray[np.float16]
    rounding: NDArray[np.float16]


@dataclass(frozen=True, slots=True)
class Pair:
    """Two pictures that share their noise.

    Attributes
    ----------
    first, second : int
        Their places among the pictures.
    correlation : float
        Of their noise, `LEAST_CORRELATION` to 1.
    """

    first: int
    second: int
    correlation: float


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """The noise of pictures, in units of that of the class.

    Attributes
    ----------
    shape : tuple of int
        Rows and columns of a fingerprint.
    noisy : (K,) int64
        Indices of the noisy differences of a fingerprint.
    median, deviation : (K,) float64
        What the pictures have in common there, and the standard deviation of their noise.
    values : (pictures, K) float64
    counted : (pictures, K) bool
        Whether a value is noise; else it is 0.
    """

    shape: tuple[int, ...]
    noisy: NDArray[np.int64]
    median: Floats
    deviation: Floats
    values: Floats
    counted: Masks


def fingerprint(image: Picture, reference: Picture) -> Fingerprint:
    """The fingerprint of a picture; both have the same size."""
    both = zip(image.bands(), reference.bands(), strict=True)
    detail, rounding = zip(*(_detail(*band) for band in both), strict=True)
    return Fingerprint(np.concatenate(detail), np.concatenate(rounding))


def _detail(image: Picture, reference: Picture) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    one, two, three, four = _quarters((image.linear - reference.linear).mean(axis=2))
    # Rounding errs by up to half a step, all channels of a grey pixel alike.
    variance = sum(half * half for half in _quarters(image.rounding.mean(axis=2))) / 3
    detail, rounding = (one - two - three + four) / 2, np.sqrt(variance) / 2
    return detail.astype(np.float16), rounding.astype(np.float16)


def noise_of(prints: Sequence[Fingerprint]) -> Noise | None:
    """The noise of pictures of one scene; None if there are too few of them, or too few noisy places."""
    if len(prints) < FEWEST_PICTURES:
        return None
    detail, rounding = (
        np.stack([getattr(each, part).ravel() for each in prints]).astype(np.float64)
        for part in ("detail", "rounding")
    )
    median, step = np.median(detail, axis=0), np.median(rounding, axis=0)
    deviation = DEVIATION_OVER_MAD * np.median(np.abs(detail - median), axis=0)
    (noisy,) = np.nonzero(deviation > ABOVE_ROUNDING * step)
    if noisy.size < FEWEST_PLACES:
        return None
    median, deviation, step = median[noisy], deviation[noisy], step[noisy]
    values = (detail[:, noisy] - median) / deviation
    counted = _counted(values, step / deviation)
    return Noise(prints[0].detail.shape, noisy, median, deviation, np.where(counted, values, 0.0), counted)


def parts(noise: Noise) -> Iterator[Noise]:
    """The whole pictures, and their quarters: a picture may be put together from others."""
    yield noise
    down, right = (
        place >= size // 2
        for place, size in zip(np.unravel_index(noise.noisy, noise.shape), noise.shape, strict=True)
    )
    for part in (~down & ~right, ~down & right, down & ~right, down & right):
        yield Noise(
            noise.shape,
            noise.noisy[part],
            noise.median[part],
            noise.deviation[part],
            noise.values[:, part],
            noise.counted[:, part],
        )


def _counted(values: Floats, step: Floats) -> Masks:
    """Mask of the values that are noise; `step` is the rounding in the same units, (K,)."""
    near = np.abs(values) <= MOST_DEVIATIONS
    loudness = np.sqrt(np.where(near, values * values, 0).sum(axis=1) / np.maximum(near.sum(axis=1), 1))
    # The median, because a picture without noise has errors too: some, at edges.
    own = DEVIATION_OVER_MAD * np.median(np.abs(values), axis=1)
    usable = (loudness <= MOST_NOISE) & (near.mean(axis=1) >= 1 - MOST_FAR)
    usable &= own * own >= ABOVE_MEDIAN * MEDIAN_VARIANCE / len(values)
    counted: Masks = near & usable[:, None] & (own[:, None] >= OWN_ABOVE_ROUNDING * step)
    return counted


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """Agreement of pictures with others, (A, B) float64 each.

    Attributes
    ----------
    counts
        Numbers of places at which both count.
    correlation
        Of their values there; 0 if there is none.
    difference
        Half the mean square of the difference there: 1 for independent noise like that of the class.
    """

    counts: Floats
    correlation: Floats
    difference: Floats

    @property
    def correlated(self) -> Masks:
        """Mask of correlations that are too high for chance."""
        sure: Masks = (self.counts >= FEWEST_PLACES) & (
            self.correlation * np.sqrt(self.counts) >= LEAST_STANDARD_ERRORS
        )
        return sure & (self.correlation >= LEAST_CORRELATION)


def pairs(noise: Noise) -> list[Pair]:
    """All pairs of pictures that share their noise."""
    found = agreement(noise.values, noise.counted, noise.values, noise.counted)
    shared = found.correlated & (found.difference <= MOST_DIFFERENCE)
    return [
        Pair(int(first), int(second), float(found.correlation[first, second]))
        for first, second in np.argwhere(np.triu(shared, 1))
    ]


def like(noise: Noise, others: Sequence[Fingerprint]) -> Masks:
    """Mask of pictures with the errors of any of some others, such as pictures without noise."""
    detail = np.stack([each.detail.ravel()[noise.noisy] for each in others]).astype(np.float64)
    values = (detail - noise.median) / noise.deviation
    near = np.abs(values) <= MOST_DEVIATIONS
    found = agreement(noise.values, noise.counted, np.where(near, values, 0.0), near)
    alike: Masks = np.asarray(found.correlated.any(axis=1))
    return alike


def agreement(values: Floats, counted: Masks, others: Floats, also: Masks) -> Agreement:
    """Compare each picture with each of the others.

    Parameters
    ----------
    values, others : (A, K), (B, K) float64
        0 where they do not count.
    counted, also : (A, K), (B, K) bool
    """
    ones, twos = counted.astype(np.float64), also.astype(np.float64)
    # Sums over the places that count in both.
    counts, products = ones @ twos.T, values @ others.T
    first, second = (values * values) @ twos.T, ones @ (others * others).T
    scale = np.sqrt(first * second)
    return Agreement(
        counts,
        products / np.where(scale > 0, scale, np.inf),
        (first + second - 2 * products) / (2 * np.maximum(counts, 1)),
    )


def _quarters(values: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """The four pixels of each 2 x 2, (H // 2, W // 2) each; an odd last row or column is left out."""
    even = values[: values.shape[0] // 2 * 2, : values.shape[1] // 2 * 2]
    return even[::2, ::2], even[::2, 1::2], even[1::2, ::2], even[1::2, 1::2]
