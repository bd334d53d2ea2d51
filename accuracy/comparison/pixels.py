"""Pixels as a file stores them, decoded to linear light a few rows at a time.

A picture of 3840 x 2160 pixels has 24 MiB of codes, and 190 MiB of linear values in double precision. So
pictures keep what their files store, and are compared in bands of rows, each with the blocks of the whole.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.blocks import BLOCK_SIDE
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats

Encoding = Literal["srgb", "linear"]

FLOAT_ROUNDING = 2.0**-22
"""Two spacings of float32: pictures of different kinds of machines differ by up to this."""

AT_ONCE = 1 << 16
"""Pixels in a band: 1.5 MiB of linear values."""


class Pixels:
    """Pixels (H, W, 3) of a picture.

    Parameters
    ----------
    stored : (H, W, 3)
        Codes of 8 or 16 bits, or floating-point numbers.
    encoding
        Their encoding.
    rounding : (H, W, 3) float64, optional
        Bound on their rounding, linear; by default that of their type.
    """

    def __init__(self, stored: NDArray[Any], encoding: Encoding, rounding: Floats | None = None) -> None:
        self.stored, self._encoding, self._rounding = stored, encoding, rounding

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and channels."""
        return self.stored.shape

    @cached_property
    def linear(self) -> Floats:
        """Linear RGB, clipped to 0..1 as a display shows it, float64."""
        if self._codes is not None:
            return self._codes[0].take(self.stored)
        values = np.clip(self.stored.astype(np.float64, copy=False), 0.0, 1.0)
        return linear_from_srgb(values).astype(np.float64) if self._encoding == "srgb" else values

    @cached_property
    def rounding(self) -> Floats:
        """Bound on the rounding of the file's numbers, linear, float64."""
        if self._rounding is not None:
            return self._rounding
        return FLOAT_ROUNDING * self.linear if self._codes is None else self._codes[1].take(self.stored)

    @property
    def seen(self) -> Floats:
        """Values as a display shows them, 0 to 1 in sRGB, float64."""
        return srgb_from_linear(self.linear) if self._codes is None else self._codes[2].take(self.stored)

    def part(self, *slices: slice) -> "Pixels":
        """A part of the picture."""
        rounding = None if self._rounding is None else self._rounding[slices]
        return self._like(self.stored[slices], rounding)

    def turned(self, turn: Any) -> "Pixels":
        """Rearranged pixels: `turn` makes a view of an array (H, W, 3)."""
        return self._like(turn(self.stored), None if self._rounding is None else turn(self._rounding))

    def _like(self, stored: NDArray[Any], rounding: Floats | None) -> "Pixels":
        made = Pixels(stored, self._encoding, rounding)
        made.__dict__["_codes"] = self._codes
        return made

    @cached_property
    def _codes(self) -> tuple[Floats, Floats, Floats] | None:
        """Linear value, rounding and displayed value of each code; None for floating-point numbers."""
        # A table has as many entries as there are codes, a picture many more pixels.
        if self.stored.dtype.kind == "f":
            return None
        largest = int(np.iinfo(self.stored.dtype).max)
        codes = np.arange(largest + 1) / largest
        above = codes + 0.5 / largest
        if self._encoding == "srgb":
            codes, above = (linear_from_srgb(table).astype(np.float64) for table in (codes, above))
        return codes, above - codes, srgb_from_linear(codes)


def bands(height: int, width: int) -> Iterator[tuple[int, int]]:
    """Half-open row ranges of bands that cut no block of the picture."""
    rows = max(AT_ONCE // width // BLOCK_SIDE, 1) * BLOCK_SIDE
    # The last row of blocks may overlap the one before it, in the same band.
    starts = range(0, max(height - BLOCK_SIDE + 1, 1), rows)
    yield from zip(starts, (*starts[1:], height), strict=True)


def bordered_bands(height: int, width: int) -> Iterator[slice]:
    """Row ranges of bands that cover all rows but the outermost, each with a row above and below."""
    return (slice(first, last + 2) for first, last in bands(height - 2, width))
