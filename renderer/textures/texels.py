"""Texels laid out for many look-ups near each other: the channels of one in a row, wrapped beforehand."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats, Integers, Masks

REACH = 16
"""Look-ups of one pixel go no farther from its centre than this, texels along either axis."""

PADDING = 2 * REACH + 2
"""Texels repeated around the image: a centre outside of a clamped image sees nothing but its rim."""

MODES = {"clamp": "edge", "repeat": "wrap", "mirror": "symmetric"}
"""What `np.pad` calls the wraps of image textures."""

CHANNELS = 4
"""Of a row, float32: `np.take` copies rows of 16 bytes four times as fast as rows of 12."""

Singles = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Centers:
    """Where n pixels lie on a table, and how far they reach.

    Attributes
    ----------
    rows : (n,) int64
        Row of the texel below and to the left of the centre.
    shares : (2, n) float32
        How far the centre is from that texel, 0 to 1.
    sides : (2, 2, n) float32
        Sides of the footprint: coordinate, side, pixel; texels.
    cut : (n,) bool
        Whether the footprint is too long for the table, so that `sides` are shorter.
    """

    rows: Integers
    shares: Singles
    sides: Singles
    cut: Masks

    def part(self, index: Integers) -> "Centers":
        """Those of some pixels (m,)."""
        return Centers(self.rows[index], self.shares[:, index], self.sides[:, :, index], self.cut[index])


@dataclass(frozen=True, slots=True, eq=False)
class TexelTable:
    """An image, or its slopes, for look-ups at many places around a centre.

    Attributes
    ----------
    rows : (N, 4) float32
        Padded texels row by row; up to four channels.
    size : tuple of int
        Width and height of the image, texels.
    wrap : {"clamp", "repeat", "mirror"}
    shift : (2, 1) float64
        Place of the first value, texels from the image's corner: 1/2 for texels.
    nearest : bool
        Whether a look-up takes the texel that it falls on, and mixes none.
    """

    rows: Singles
    size: tuple[int, int]
    wrap: str
    shift: Floats
    nearest: bool

    def centers(self, coordinates: Floats, footprints: Floats) -> Centers:
        """Place pixels at texture coordinates (2, n) with footprints (2, 2, n) on the table."""
        size = np.array(self.size, dtype=np.float64)[:, None]
        places, sides = coordinates * size, footprints * size[:, None]
        reach = np.abs(sides).sum(axis=1).max(axis=0) / 2
        sides *= np.minimum(1.0, REACH / np.maximum(reach, 1.0))
        if self.wrap == "clamp":
            places = np.clip(places, -REACH - 1.0, size + REACH)
        elif self.wrap == "repeat":
            places -= size * np.floor(places / size)
        else:
            places -= 2 * size * np.floor(places / (2 * size))
            turned = places > size
            places = np.where(turned, 2 * size - places, places)
            sides = np.where(turned[:, None], -sides, sides)
        places -= self.shift
        whole = np.floor(places)
        column, row = (whole + PADDING).astype(np.int64)
        width = self.size[0] + 2 * PADDING
        shares = (places - whole).astype(np.float32)
        return Centers(row * width + column, shares, sides.astype(np.float32), reach > REACH)

    def at(self, centers: Centers, offsets: Singles, channels: int) -> list[Singles]:
        """Values, (K, n) for each channel, at `offsets` (2, K, 1) in shares of the footprints."""
        across, along = offsets
        x = centers.sides[0, 0] * across + centers.sides[0, 1] * along
        y = centers.sides[1, 0] * across + centers.sides[1, 1] * along
        x += centers.shares[0]
        y += centers.shares[1]
        column, row = np.floor(x), np.floor(y)
        x -= column
        y -= row
        width = self.size[0] + 2 * PADDING
        row *= np.float32(width)
        row += column
        index = row.astype(np.int64)
        index += centers.rows
        if self.nearest:
            texels = np.take(self.rows, index, axis=0, mode="clip")
            return [texels[..., channel] for channel in range(channels)]
        corners = [np.take(self.rows, index + step, axis=0, mode="clip") for step in (0, 1, width, width + 1)]
        return [_mixed([corner[..., channel] for corner in corners], x, y) for channel in range(channels)]


def _mixed(corners: list[Singles], x: Singles, y: Singles) -> Singles:
    """Between two texels, and between the two above them."""
    a, b, c, d = corners
    low, high = b - a, d - c
    low *= x
    low += a
    high *= x
    high += c
    high -= low
    high *= y
    high += low
    return high


def table(texels: NDArray[np.float32], wrap: str, *, nearest: bool) -> TexelTable:
    """The table of an image (H, W, channels)."""
    height, width, channels = texels.shape
    around = ((PADDING, PADDING), (PADDING, PADDING), (0, CHANNELS - channels))
    padded = np.zeros((height + 2 * PADDING, width + 2 * PADDING, CHANNELS), dtype=np.float32)
    padded[..., :channels] = np.pad(texels, (*around[:2], (0, 0)), mode=MODES[wrap])  # type: ignore[call-overload]
    shift = np.full((2, 1), 0.0 if nearest else 0.5)
    return TexelTable(padded.reshape(-1, CHANNELS), (width, height), wrap, shift, nearest)


def slopes(heights: Floats, wrap: str) -> tuple[TexelTable, TexelTable]:
    """Tables of the slopes of heights (H, W) by u and by v: differences over one texel about a place.

    Bilinear heights half a texel to either side differ by what is bilinear between differences of neighbours.
    """
    height, width = heights.shape
    padded = np.pad(heights, PADDING + 1, mode=MODES[wrap])  # type: ignore[call-overload]
    found = []
    for axis, by in (
        (1, np.diff(padded, axis=1)[1:-1, 1:] * width),
        (0, np.diff(padded, axis=0)[1:, 1:-1] * height),
    ):
        rows = np.zeros((by.size, CHANNELS), dtype=np.float32)
        rows[:, 0] = by.ravel()
        shift = np.full((2, 1), 0.5)
        shift[1 - axis] = 1.0
        found.append(TexelTable(rows, (width, height), wrap, shift, nearest=False))
    return found[0], found[1]
