"""Pictures whose pixels lie in the wrong place by a pixel or less, predicted from the right picture.

A wrong place cannot be undone in the wrong picture without smoothing its noise. It can be made in the right
one, which has none.
"""

from dataclasses import dataclass

import numpy as np

from accuracy.comparison.mistakes import OFFSETS, SHIFTS
from renderer.math.arrays import Floats

SIZE_MINUS_ONE = "size_minus_one"


@dataclass(frozen=True, slots=True)
class Displacement:
    """Displacement of a picture's content relative to the right one.

    Attributes
    ----------
    cause : str
        A word for programs.
    hint : str
        For people.
    right, down : float
        How far everything lies to the right and down, in pixels.
    stretched : bool
        Whether a picture of n pixels shows what n - 1 should show, from the upper left corner.
    """

    cause: str
    hint: str
    right: float = 0.0
    down: float = 0.0
    stretched: bool = False

    @property
    def is_half(self) -> bool:
        """Whether it is a shift by half a pixel."""
        return 0.5 in (abs(self.right), abs(self.down))

    def places(self, x: Floats, y: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """Position in the right picture of the wrong one's content at x, y, pixels from the upper left."""
        if self.stretched:
            x, y = x * (width / (width - 1)), y * (height / (height - 1))
        return x - self.right, y - self.down

    def of(self, picture: Floats, step: int = 1) -> Floats:
        """The wrong picture, (H, W, ...), by cubic interpolation of the right one; `thinned` by a step.

        Beyond its borders the right picture is taken to continue as its outermost pixels.
        """
        height, width = picture.shape[:2]
        if min(height, width) < 2:
            return thinned(picture, step)
        columns, rows = (
            np.arange(side, dtype=np.float64)[_kept(side, step)] + 0.5 for side in (width, height)
        )
        x, y = self.places(columns, rows, width, height)
        return _resampled(_resampled(picture, y - 0.5, 0), x - 0.5, 1)


def thinned(values: Floats, step: int) -> Floats:
    """Every so many rows and columns of a picture, as far from one border as from the other."""
    return values if step == 1 else values[_kept(values.shape[0], step), _kept(values.shape[1], step)]


def _kept(side: int, step: int) -> slice:
    margin = (side - 1) % step
    margin += step * (margin % 2)
    return slice(margin // 2, side - margin // 2, step)


def _resampled(values: Floats, places: Floats, axis: int) -> Floats:
    """Values at places along an axis, in units of its indices, by cubic convolution (Keys 1981)."""
    below = np.floor(places)
    f = places - below
    weights = (
        ((2 - f) * f - 1) * f / 2,
        ((3 * f - 5) * f * f + 2) / 2,
        ((4 - 3 * f) * f + 1) * f / 2,
        (f - 1) * f * f / 2,
    )
    total = np.zeros((*values.shape[:axis], places.size, *values.shape[axis + 1 :]))
    along = [1] * values.ndim
    along[axis] = -1
    for step, weight in enumerate(weights, -1):
        if weight.any():
            indices = np.clip(below.astype(np.intp) + step, 0, values.shape[axis] - 1)
            total += weight.reshape(along) * values.take(indices, axis)
    return total


DISPLACEMENTS = (
    *(
        Displacement(mistake.cause, mistake.hint, pixels * x, pixels * y)
        for (x, y), whole, half in zip(OFFSETS, SHIFTS[::2], SHIFTS[1::2], strict=True)
        for mistake, pixels in ((whole, 1.0), (half, 0.5))
    ),
    Displacement(
        SIZE_MINUS_ONE,
        "The picture is stretched by a pixel: places are divided by width - 1 and height - 1. Divide by "
        "width and height; the centre of pixel i is at i + 0.5.",
        stretched=True,
    ),
)
"""Displacements that are tried."""
