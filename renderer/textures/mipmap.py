"""Image textures with a pyramid of smaller versions of themselves (Williams 1983).

Each level is half as wide and high as the one below, rounded down, and each of its texels is the mean of the
part of the level below that it covers: a box, formed from linear values. A look-up interpolates between two
levels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import schemas.textures as language
from renderer.assets import AssetSource
from renderer.math.arrays import Floats
from renderer.textures import image
from renderer.textures.image import ImageTexture


@dataclass(frozen=True, slots=True)
class MipmapTexture:
    """A pyramid of textures.

    Attributes
    ----------
    levels : tuple of ImageTexture
        Bilinear; the image itself first, a single texel last.
    share : float
        Of the sides of a footprint that a look-up averages over.
    """

    levels: tuple[ImageTexture, ...]
    share: float = 1.0

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Values (3, N) at texture coordinates (2, N), over footprints (2, 2, N) if there are any."""
        if footprints is None:
            return self.levels[0].at(coordinates)
        level = self.level(footprints)
        whole = np.floor(level)
        values = np.empty((3, level.size))
        for number in range(len(self.levels)):
            chosen = np.flatnonzero(whole == number)
            if chosen.size:
                values[:, chosen] = self._between(number, coordinates[:, chosen], level[chosen] - number)
        return values

    def level(self, footprints: Floats) -> Floats:
        """Place in the pyramid, (N,): the longer side of the footprint is one texel there.

        The longer side decides, so nothing aliases, and what is seen at a grazing angle is blurred along the
        other side too.
        """
        height, width = self.levels[0].texels.shape[:2]
        sides = self.share * np.hypot(footprints[0] * width, footprints[1] * height)
        return np.clip(np.log2(np.maximum(np.maximum(sides[0], sides[1]), 1.0)), 0.0, len(self.levels) - 1)

    def _between(self, number: int, coordinates: Floats, share: Floats) -> Floats:
        low = self.levels[number].at(coordinates)
        if number + 1 == len(self.levels):
            return low
        return low + share * (self.levels[number + 1].at(coordinates) - low)


def halved(values: Floats) -> Floats:
    """Means of the parts of axis 0 that half as many texels cover, (n, ...) -> (n // 2, ...).

    An odd number of texels shares every third one out by the length that falls to each side. Formed from
    differences, so that a constant stays what it is.
    """
    count = values.shape[0] // 2
    if count == 0:
        return values
    first, second = values[0 : 2 * count : 2], values[1 : 2 * count : 2]
    if values.shape[0] % 2 == 0:
        return first + 0.5 * (second - first)
    third = values[2 : 2 * count + 1 : 2]
    number = np.arange(count, dtype=np.float64).reshape(-1, *[1] * (values.ndim - 1))
    total = values.shape[0]
    return second + (count - number) / total * (first - second) + (number + 1) / total * (third - second)


def pyramid(base: ImageTexture) -> MipmapTexture:
    """All levels over an image."""
    levels, values = [base], _next_level(base.texels)
    while values is not None:
        levels.append(ImageTexture(values.astype(np.float32), base.filter, base.wrap))
        values = _next_level(values)
    return MipmapTexture(tuple(levels))


BAND_VALUES = 1 << 20
"""Values that are halved at once: a large image in double precision takes twice its own memory."""


def _next_level(values: NDArray[np.floating]) -> Floats | None:
    """Means (H // 2, W // 2, 3) of an image (H, W, 3), where a side of 1 stays; None of a single texel."""
    height, width = values.shape[:2]
    if height == width == 1:
        return None
    low = np.empty((max(1, height // 2), width, 3))
    columns = max(1, BAND_VALUES // (3 * height))
    for start in range(0, width, columns):
        band = slice(start, start + columns)
        low[:, band] = halved(values[:, band].astype(np.float64))
    small = np.empty((low.shape[0], max(1, width // 2), 3))
    rows = max(1, BAND_VALUES // (3 * width))
    for start in range(0, low.shape[0], rows):
        band = slice(start, start + rows)
        small[band] = halved(low[band].swapaxes(0, 1)).swapaxes(0, 1)
    return small


def build(texture: language.ImageTexture, assets: AssetSource) -> ImageTexture | MipmapTexture:
    """The texture of a scene, with a pyramid if its filter needs one."""
    base = image.build(texture, assets)
    return pyramid(base) if texture.filter == "mipmap" else base
