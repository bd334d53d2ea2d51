"""Why two pictures differ: likely mistakes, each undone alone to see what that leaves of the difference."""

import math
from dataclasses import dataclass

import numpy as np

from accuracy.comparison.blocks import bias, gathered
from accuracy.comparison.blurs import LEAST_FILTER, blur
from accuracy.comparison.mistakes import Mistake, candidates
from renderer.math.arrays import Floats, Masks

HALF = 0.5
"""A mistake is named where undoing it leaves less than this share of the RMSE."""

FAIR = 0.75
"""And of the RMSE that its control leaves."""

GAIN = 0.1
"""Least share of the mean square that undoing removes where noise hides the rest,"""

SURE = 4.0
"""standard errors of that gain over all blocks (one false alarm in 30,000),"""

SKIPPED = 4
"""Step between the rows that are compared first."""

MOST = 3
"""Causes reported. Those after the first are much the same picture undone in another way."""

ALIKE = 1.25
"""Other causes are reported only if they leave at most this many times the RMSE of the first."""

JAGGED = "antialiasing_missing"

JAGGED_HINT = (
    "Edges are jagged: each pixel shows one side of an edge, where the reference shows how much of each it "
    "covers. Take the mean of several camera samples over the pixel's square."
)

BLURRED = "blurred"

BLURRED_HINT = (
    "Edges are softer than the reference's, as after a Gaussian of {:g} pixels. A blur does not replace "
    "samples: take the mean of several camera samples over each pixel's own square, and filter nothing "
    "afterwards."
)

FILTERED = "pixel_filter"

FILTERED_HINT = (
    "Each pixel shows more than its own square, as with a tent or a Gaussian as pixel filter. Take the mean "
    "of samples over the pixel's own square."
)

EDGE = 0.2
"""Least step of brightness as seen, 0..1, that is taken for an edge."""

BETWEEN = 0.2
"""A pixel shows both sides if it is farther than this share of the step from either."""

FEW = 0.6
"""Anti-aliasing is missing where fewer than this share of the reference's pixels that show both sides do.

Without it textures and penumbrae still give some of them; with 4 samples a pixel most are there.
"""

ONE_SIDED = 0.35
"""Least mean square of their errors, over that of pixels which show one side: a sample in the middle leaves
0.45 or more, four random ones 0.25. In a 2 x 2 grid, edges along its rows show few pixels of both sides, too,
but leave at most 0.3."""

LEAST = 16
"""Pixels of the reference that show both sides, below which nothing is said."""


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
    image: Floats,
    reference: Floats,
    lumas: tuple[Floats, Floats],
    allowed: Floats,
    most_bias: float,
    errors: Floats | None = None,
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
    errors
        Standard errors of the reference, (H, W, 3), if they are known.

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
        found = trial.edges(*lumas) or trial.blurs(errors)
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
        left = jagged_left_over(self._image, self._reference, seen, wanted)
        if left is None or left > HALF**2 * self._before:
            return []
        return [Cause(JAGGED, JAGGED_HINT, math.sqrt(self._before), math.sqrt(left))]

    def blurs(self, errors: Floats | None) -> list[Cause]:
        """A blur, which is reproduced with the reference."""
        found = blur(self._image, self._reference, errors)
        if found is None:
            return []
        undone = self._image - found.effect
        after = self._square(undone)
        if after >= HALF**2 * self._before and not self._gains(undone, self._image):
            return []
        hint = BLURRED_HINT.format(found.width)
        return [Cause(BLURRED, hint, math.sqrt(self._before), math.sqrt(after))]

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


def filtered(image: Floats, reference: Floats, errors: Floats) -> tuple[Cause, ...]:
    """The filter of a noisy picture whose pixels are no means over their squares; empty where they may be."""
    found = blur(image, reference, errors, LEAST_FILTER)
    if found is None:
        return ()
    before, after = (
        float(np.mean(left * left)) for left in (image - reference, image - reference - found.effect)
    )
    return (Cause(FILTERED, FILTERED_HINT, math.sqrt(before), math.sqrt(after)),)


def jagged_left_over(image: Floats, reference: Floats, seen: Floats, wanted: Floats) -> float | None:
    """Mean square that remains if pixels may show what any neighbour of theirs shows; None for soft edges.

    A picture without anti-aliasing is then right everywhere.

    Parameters
    ----------
    image, reference : (H, W, 3)
        Linear.
    seen, wanted : (H, W)
        Brightness of both as seen, 0 to 1.
    """
    soft = soft_edges(wanted)
    if soft is None:
        return None
    low, high = neighbourhood(seen)
    if np.count_nonzero(soft[0] & _between(seen, low, high)) >= FEW * soft[1]:
        return None
    low, high = neighbourhood(wanted)
    both = soft[0] & _between(wanted, low, high)
    one_sided = (wanted - low) * (high - wanted)
    if np.sum((seen - wanted)[both] ** 2) < ONE_SIDED * np.sum(one_sided[both]):
        return None
    least, most = neighbourhood(reference)
    beyond = image - np.clip(image, least, most)
    return float(np.mean(beyond * beyond))


def soft_edges(wanted: Floats) -> tuple[Masks, int] | None:
    """Mask of edge pixels, and the number of them that show both sides; None if too few to judge.

    Parameters
    ----------
    wanted : (H, W)
        Brightness of a picture as seen, 0 to 1.
    """
    low, high = neighbourhood(wanted)
    edges: Masks = high - low > EDGE
    count = int(np.count_nonzero(edges & _between(wanted, low, high)))
    return None if count < LEAST else (edges, count)


def neighbourhood(values: Floats) -> tuple[Floats, Floats]:
    """Least and largest of each pixel and its eight neighbours, (H, W, ...) -> two of the same shape."""
    return _extreme(values, np.minimum), _extreme(values, np.maximum)


def _extreme(values: Floats, chosen: np.ufunc) -> Floats:
    tall = values.copy()
    chosen(tall[1:], values[:-1], out=tall[1:])
    chosen(tall[:-1], values[1:], out=tall[:-1])
    wide = tall.copy()
    chosen(wide[:, 1:], tall[:, :-1], out=wide[:, 1:])
    chosen(wide[:, :-1], tall[:, 1:], out=wide[:, :-1])
    return wide


def _between(values: Floats, low: Floats, high: Floats) -> Masks:
    margin = BETWEEN * (high - low)
    return (values > low + margin) & (values < high - margin)
