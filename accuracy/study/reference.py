"""References of known error, and the errors of other pictures against them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from accuracy.statistics import clipped

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from renderer.math.arrays import Floats, Masks

HOT_PIXEL_ERROR = 0.1
"""A pixel with a larger error in some channel is conspicuous: 25 steps of 8 bits."""

EDGE_DIFFERENCE = 0.1
"""Neighbours that differ by more have an edge between them."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The error of a picture against the converged one.

    Attributes
    ----------
    mse : float
        Unbiased estimate of the mean squared error of linear values clipped to 0..1: the reference's own
        error is subtracted. It may be below 0 if the picture is more accurate than the reference.
    by_reference : float
        Standard error of `mse` due to the reference's own error.
    by_pixels : float
        Bound on the standard error of `mse`, including the reference's part, for independent pixels.
    edges_mse, smooth_mse : float
        The same over pixels beside edges, and over all others; 0 if there are none.
    hot : float
        Share of pixels, 0 to 1, that are off by more than `HOT_PIXEL_ERROR` in some channel.
    """

    mse: float
    by_reference: float
    by_pixels: float
    edges_mse: float
    smooth_mse: float
    hot: float


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Two independent converged pictures.

    Attributes
    ----------
    first, second : (H, W, 3) float64
        Linear values clipped to 0..1, made with different seeds.
    """

    first: Floats
    second: Floats

    @property
    def mean(self) -> Floats:
        """The reference itself, (H, W, 3)."""
        return (self.first + self.second) / 2

    @property
    def own_mse(self) -> float:
        """Mean squared error of `mean`: a quarter of that between the halves."""
        return float(np.mean((self.first - self.second) ** 2)) / 4

    def edges(self) -> Masks:
        """Mask (H, W) of neighbours that differ by more than `EDGE_DIFFERENCE` in some channel."""
        mean = self.mean
        marked = np.zeros(mean.shape[:2], dtype=bool)
        beside = (np.abs(np.diff(mean, axis=1)) > EDGE_DIFFERENCE).any(axis=2)
        below = (np.abs(np.diff(mean, axis=0)) > EDGE_DIFFERENCE).any(axis=2)
        marked[:, 1:] |= beside
        marked[:, :-1] |= beside
        marked[1:] |= below
        marked[:-1] |= below
        return marked

    def judge(self, image: NDArray[Any]) -> Judgement:
        """Compare a picture, (H, W, 3) linear, whose random numbers are not those of the reference.

        The mean of (x - a)(x - b) over pixels x of the picture and a, b of the halves is the mean squared
        difference from the reference less the reference's own mean squared error: an identity. Its
        expectation is the squared error of x, as the errors of the halves are independent.

        The noise of the halves adds (x - (a + b)/2)(a - b), whose mean is 0 and whose squares can be
        measured.
        """
        picture = clipped(image)
        products = np.mean((picture - self.first) * (picture - self.second), axis=2)
        noise = np.mean((picture - self.mean) * (self.first - self.second), axis=2)
        edges = self.edges()
        return Judgement(
            mse=float(products.mean()),
            by_reference=float(np.sqrt(np.sum(noise**2))) / noise.size,
            by_pixels=float(np.sqrt(np.sum(products**2))) / products.size,
            edges_mse=_mean(products[edges]),
            smooth_mse=_mean(products[~edges]),
            hot=float((np.abs(picture - self.mean) > HOT_PIXEL_ERROR).any(axis=2).mean()),
        )


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else 0.0
