"""The error of pictures of fixed quality, estimated from the differences of their passes.

Two passes whose samples are independent have means that differ by the errors of both. With n and m samples
and equal variances, the squared difference is on average (n + m)^2 / (n m) times the squared error of the
mean of all. That holds for random samples only: those of other patterns depend on each other, and the
difference of their passes over- or underestimates the error of their mean.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from renderer.adaptive.uncertainty import ErrorEstimate, error_of
from renderer.film import Image, compose
from renderer.plan.plan import RenderPlan
from schemas.tiles import Pass

FEWEST_PASSES = 3
"""Least passes: the preview, and two to compare."""

ESTIMATE_VARIANCE = 4 / 3
"""Variance of a pixel's estimate minus its true squared error, relative to the mean square of the estimate.

If both errors are normal with variance s and independent, each square has the variance 2 s^2, and the mean
square of the estimate is 3 s^2.
"""


def unknown_error(plan: RenderPlan) -> str | None:
    """Why the passes of a plan of fixed quality give no estimate of its error; None if they do."""
    pattern = plan.antialiasing.pattern
    if pattern != "random":
        return (
            f"The camera samples of the pattern {pattern!r} depend on each other, so that passes do not show "
            "how far they are from the converged picture. Target quality estimates that, and so does the "
            "pattern 'random'."
        )
    if any(lighting.emitter.shared and lighting.emitter.extent > 0 for lighting in plan.lightings):
        return (
            "All camera samples use the same points of a light, so that no pass shows what lies between "
            "them. Target quality estimates the error, and so do other patterns than 'uniform'."
        )
    if len(plan.passes) < FEWEST_PASSES:
        return "With one camera sample per pixel there is no second pass to compare with."
    return None


@dataclass(frozen=True, slots=True)
class Squares:
    """Estimated squared errors, mean over channels, summed up over pixels.

    `variance` is that of the difference between this sum and the true one of the picture.
    """

    total: float
    variance: float


def squares_of(parts: Sequence[tuple[Pass, Image]]) -> dict[int, Squares]:
    """Error estimates of a tile by the index of the pass, from the second pass with samples on.

    Parameters
    ----------
    parts
        Passes of independent samples, in order, with their pixels (h, w, 3) linear. The preview is ignored.

    Returns
    -------
    dict of int to Squares
        Of pixels clipped to 0..1. Without bias where nothing is clipped, see `test_errors_of_passes`.
    """
    rounds = [(pass_, pixels) for pass_, pixels in parts if pass_.stride == 1]
    found = {}
    for place in range(1, len(rounds)):
        pass_, pixels = rounds[place]
        before = np.clip(compose(rounds[:place]).astype(np.float64), 0, 1)
        share = pass_.first / pass_.last
        # NaN counts as the largest possible error.
        apart = np.nan_to_num(np.clip(pixels.astype(np.float64), 0, 1) - before, nan=1.0)
        squares = (apart**2).mean(axis=2) * (share * (1 - share))
        found[pass_.index] = Squares(float(squares.sum()), ESTIMATE_VARIANCE * float((squares**2).sum()))
    return found


def errors_of(tiles: Iterable[dict[int, Squares]], pixels: int) -> dict[int, ErrorEstimate]:
    """The errors of a whole picture after each pass, from those of its tiles."""
    sums: dict[int, Squares] = {}
    for tile in tiles:
        for index, squares in tile.items():
            so_far = sums.get(index, Squares(0.0, 0.0))
            sums[index] = Squares(so_far.total + squares.total, so_far.variance + squares.variance)
    return {index: error_of(squares.total, squares.variance, pixels) for index, squares in sums.items()}
