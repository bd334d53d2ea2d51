"""Why two pictures differ: each mistake is undone alone, and what becomes of the difference is looked at."""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import hard_edges
from accuracy.comparison.blocks import bias, gathered
from accuracy.comparison.mistakes import Mistake, candidates
from renderer.math.arrays import Floats

HALF = 0.5
"""A mistake is named where undoing it leaves less than this share of the RMSE."""

FAIR = 0.75
"""And of the RMSE that its control leaves."""

GAIN = 0.1
"""Where noise hides the rest: the least share of the mean square that undoing takes away,"""

SURE = 5.0
"""standard errors of that gain over all blocks (one false alarm in three million),"""

SKIPPED = 4
"""Of so many rows one is looked at first."""

MOST = 3
"""Causes told. Those after the first are much the same picture undone in another way."""

ALIKE = 1.25
"""Other causes are told only if they leave no more than so many times the RMSE of the first."""


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake that explains most of a difference.

    Attributes
    ----------
    cause, hint : str
    rmse_before, rmse_after : float
        Linear, all but the outermost pixels: as they are, and with the mistake undone.
    """

    cause: str
    hint: str
    rmse_before: float
    rmse_after: float


def diagnose(
    image: Floats, reference: Floats, lumas: tuple[Floats, Floats], allowed: Floats, most_bias: float
) -> tuple[Cause, ...]:
    """Mistakes that explain the difference of two linear pictures (H, W, 3), the best explanation first.

    Parameters
    ----------
    lumas
        Brightness of both as seen, (H, W) each.
    allowed
        As `blocks.bias` takes it.
    most_bias
        Share of biased blocks with which two pictures still agree.

    Returns
    -------
    tuple of Cause
        Empty where no single mistake explains it, or there is nothing to explain.
    """
    if min(image.shape[:2]) < 3:
        return ()
    trial = _Trial(image, reference, allowed, most_bias)
    found = [cause for mistake in candidates(image, reference) if (cause := trial.of(mistake)) is not None]
    if not found:
        found = trial.edges(*lumas)
    found.sort(key=lambda cause: cause.rmse_after)
    return tuple(cause for cause in found[:MOST] if cause.rmse_after <= ALIKE * found[0].rmse_after)


class _Trial:
    """One picture and its reference, with what does not change from mistake to mistake."""

    def __init__(self, image: Floats, reference: Floats, allowed: Floats, most_bias: float) -> None:
        self._image, self._reference = image, reference
        self._allowed, self._most_bias = allowed, most_bias
        self._inner = np.ascontiguousarray(reference[1:-1, 1:-1])
        self._before, self._glance = self._square(image), self._square(image, SKIPPED)

    def of(self, mistake: Mistake) -> Cause | None:
        """The cause that a mistake is, if it is one."""
        if self._before == 0:
            return None
        undone = mistake.undo(self._image)
        # Most mistakes were not made, and a part of the rows shows it.
        if self._square(undone, SKIPPED) > self._glance:
            return None
        after = self._square(undone)
        if after > (1 - GAIN) * self._before:
            return None
        compared = mistake.control(self._image) if mistake.control else self._image
        fair = self._square(compared)
        clear = after < HALF**2 * self._before and after < FAIR**2 * fair
        if not clear and not self._gains(undone, compared):
            return None
        return Cause(mistake.cause, mistake.hint, math.sqrt(self._before), math.sqrt(after))

    def edges(self, seen: Floats, wanted: Floats) -> list[Cause]:
        """Missing anti-aliasing, which no change of the picture undoes."""
        left = hard_edges.left_over(self._image, self._reference, seen, wanted)
        if left is None or left > HALF**2 * self._before:
            return []
        return [Cause(hard_edges.CAUSE, hard_edges.HINT, math.sqrt(self._before), math.sqrt(left))]

    def _square(self, picture: Floats, step: int = 1) -> float:
        """Mean squared difference from the reference, of every so many rows."""
        # The outermost pixels have no neighbour to be moved in from.
        difference = picture[1:-1:step, 1:-1] - self._inner[::step]
        # In place and without BLAS, whose threads cost more than they bring where half a processor is given.
        return float(np.multiply(difference, difference, out=difference).mean())

    def _gains(self, undone: Floats, compared: Floats) -> bool:
        """Whether undoing helps in many blocks beyond doubt, and the pictures then agree."""
        gain = (compared - self._reference) ** 2 - (undone - self._reference) ** 2
        blocks = gathered(gain[1:-1, 1:-1].mean(axis=2)).mean(axis=2).ravel()
        spread = float(blocks.std()) / math.sqrt(blocks.size)
        mean = float(blocks.mean())
        # A slope moved by a pixel looks like a bias so small that it is allowed.
        least = max(GAIN * self._before, float(np.mean(self._allowed)) ** 2, SURE * spread)
        if mean < least:
            return False
        return bias(undone - self._reference, self._allowed).share <= self._most_bias
