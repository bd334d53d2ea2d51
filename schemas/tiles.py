"""Pieces of a picture and rounds of samples, as every package names them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tile:
    """The pixels [x0, x1) x [y0, y1), rows from the top: the unit of work and of streaming."""

    index: int
    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        """Columns, pixels."""
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        """Rows, pixels."""
        return self.y1 - self.y0


@dataclass(frozen=True, slots=True)
class Pass:
    """One round over all tiles: the camera samples [first, last) of every pixel.

    With ``stride`` > 1 it is a coarse preview: pixel (i * stride, j * stride) stands for its stride x stride
    block.
    """

    index: int
    stride: int
    first: int
    last: int

    @property
    def begins(self) -> bool:
        """Whether the camera samples of all pixels begin in it; it records what the centres show, too."""
        return self.stride == 1 and self.first == 0
