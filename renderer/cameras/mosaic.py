"""The camera of a part of a picture: squares from all over it, one below the other."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from renderer.cameras.pinhole import Pinhole
from renderer.math.arrays import Floats, Integers, Masks


@dataclass(frozen=True, eq=False)
class Mosaic(Pinhole):
    """A camera whose raster is a column of squares of another camera's raster.

    Attributes
    ----------
    whole : Pinhole
        The camera of the whole picture, with or without a lens.
    side : int
        Side of the squares, pixels.
    corners : (n, 2) int64
        Columns and rows of the upper left pixels of the squares, multiples of the side.
    """

    whole: Pinhole
    side: int
    corners: Integers

    @classmethod
    def of(cls, whole: Pinhole, side: int, corners: Integers) -> Self:
        """The camera of squares of a picture; no square may reach beyond its edges."""
        view = (whole.position, whole.right, whole.up, whole.forward, whole.half_width, whole.half_height)
        return cls(*view, width=side, height=side * len(corners), whole=whole, side=side, corners=corners)

    def screen(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Place on the screen of the whole camera, of raster positions of this one."""
        return self.whole.screen(*self._in_whole(x, y))

    def bounds(self, x0: int, y0: int, x1: int, y1: int) -> Floats:
        """Bounds of all squares that a rectangle of this raster touches, (4,)."""
        touched = self.corners[y0 // self.side : -(-y1 // self.side)]
        (left, top), (right, bottom) = touched.min(axis=0), touched.max(axis=0)
        return self.whole.bounds(left + x0, top, right + x1, bottom + self.side)

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """As of the whole camera, at raster positions of this one."""
        return self.whole.rays(*self._in_whole(x, y), pixels, samples)

    def blur(self, forward: Floats) -> Floats:
        """As of the whole camera."""
        return self.whole.blur(forward)

    def _in_whole(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        square = np.minimum((y / self.side).astype(np.int64), len(self.corners) - 1)
        corner = self.corners[square]
        return x + corner[:, 0], y - square * self.side + corner[:, 1]

    def places(self, pixels: Integers) -> Integers:
        """Those pixels of the whole picture that are in this one, moved there.

        Parameters
        ----------
        pixels : (2 or more, N) int64
            Columns, rows, and anything else that goes with them.
        """
        columns, rows = pixels[:2]
        square = self._numbers[rows // self.side, columns // self.side]
        found = np.stack([columns % self.side, square * self.side + rows % self.side, *pixels[2:]])
        return found[:, square >= 0]

    @cached_property
    def _numbers(self) -> Integers:
        """Number of the square at each cell of the whole picture, -1 where there is none."""
        found = np.full((-(-self.whole.height // self.side), -(-self.whole.width // self.side)), -1)
        found[self.corners[:, 1] // self.side, self.corners[:, 0] // self.side] = np.arange(len(self.corners))
        return found

    def borders(self) -> Masks:
        """Pixels (H, W) that lie beside a square from elsewhere, or beside none."""
        found = np.zeros((self.height, self.width), dtype=bool)
        found[:, [0, -1]] = True
        found[:: self.side] = True
        found[self.side - 1 :: self.side] = True
        return found
