"""Pictures whose pixels lie in the wrong place by a pixel or less, predicted from the right picture.

A wrong place cannot be undone in the wrong picture without smoothing its noise. It can be made in the right
one, which has none, or by the camera that renders it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from accuracy.comparison.mistakes import OFFSETS, SHIFTS
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats
from service.grading.mistakes.hints import HINTS

SIZE_MINUS_ONE = "size_minus_one"

BORDER, CENTRE = 0.0, 0.5
"""Origins of programs that divide by width - 1: the border of the first pixel, or its centre."""


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
    stretched_from : float or None
        If a picture of n pixels shows what n - 1 should show, the position along each side, in pixels, that
        shows the upper left corner of the right one.
    """

    cause: str
    hint: str
    right: float = 0.0
    down: float = 0.0
    stretched_from: float | None = None

    @property
    def is_half(self) -> bool:
        """Whether it is a shift by half a pixel."""
        return 0.5 in (abs(self.right), abs(self.down))

    def places(self, x: Floats, y: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """Position in the right picture of the wrong one's content at x, y, pixels from the upper left."""
        if (origin := self.stretched_from) is not None:
            x, y = (x - origin) * (width / (width - 1)), (y - origin) * (height / (height - 1))
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


@dataclass(frozen=True, slots=True, eq=False)
class DisplacedPinhole(Pinhole):
    """A camera whose pixels lie in the wrong place.

    Attributes
    ----------
    displacement : Displacement
    columns, rows : int
        Pixels of the whole picture; `width` and `height` may be those of a smaller trial.
    """

    displacement: Displacement
    columns: int
    rows: int

    @classmethod
    def of(cls, displacement: Displacement, columns: int, rows: int, right: Pinhole) -> DisplacedPinhole:
        """The camera `right` with a displacement."""
        kept = {field.name: getattr(right, field.name) for field in fields(Pinhole)}
        return cls(**kept, displacement=displacement, columns=columns, rows=rows)

    def screen(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Place on the screen of raster positions, as in `Pinhole`."""
        across, down = self.columns / self.width, self.rows / self.height
        x, y = self.displacement.places(across * x, down * y, self.columns, self.rows)
        return Pinhole.screen(self, x / across, y / down)


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


STRETCHED = tuple(
    Displacement(SIZE_MINUS_ONE, HINTS[SIZE_MINUS_ONE], stretched_from=origin) for origin in (BORDER, CENTRE)
)

DISPLACEMENTS = (
    *(
        Displacement(mistake.cause, mistake.hint, pixels * x, pixels * y)
        for (x, y), whole, half in zip(OFFSETS, SHIFTS[::2], SHIFTS[1::2], strict=True)
        for mistake, pixels in ((whole, 1.0), (half, 0.5))
    ),
    *STRETCHED,
)
"""Displacements that are tried."""
