"""Image textures: texel centres at (i + 1/2) / width, row 0 of the file on the side v = 1."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import schemas.textures as language
from renderer.assets import AssetError, AssetSource, content_of, limits_of
from renderer.images.colors import linear_from_srgb
from renderer.images.decoded import DecodedImage
from renderer.images.reading import read_image
from renderer.math.arrays import Floats, Integers


def _clamp(index: Integers, size: int) -> Integers:
    return np.clip(index, 0, size - 1)


def _repeat(index: Integers, size: int) -> Integers:
    return np.mod(index, size)


def _mirror(index: Integers, size: int) -> Integers:
    index = np.mod(index, 2 * size)
    return np.minimum(index, 2 * size - 1 - index)


WRAPS = {"clamp": _clamp, "repeat": _repeat, "mirror": _mirror}
"""Wrap modes: map texel numbers outside of the image to texels."""


@dataclass(frozen=True, slots=True, eq=False)
class ImageTexture:
    """Texels and how to look them up.

    Attributes
    ----------
    texels : (H, W, 3) float32
        Row 0 at v = 0.
    filter : {"nearest", "bilinear", "mipmap"}
        A level of a pyramid is bilinear.
    wrap : {"clamp", "repeat", "mirror"}
    bounds : tuple of float
        Of all values: 0 and 1, and farther apart only where the file stores floating-point numbers.
    notes : tuple of str
        Sentences about parts of the file that are not used, or were chosen.
    rows : (H * W, 4) float32
        Memory of the texels, each with a fourth value: `np.take` copies 16 bytes four times as fast as 12.
    """

    texels: NDArray[np.float32]
    filter: str
    wrap: str
    bounds: tuple[float, float] = (0.0, 1.0)
    notes: tuple[str, ...] = ()
    rows: NDArray[np.float32] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Lay the texels out for look-ups."""
        padded = np.pad(self.texels, ((0, 0), (0, 0), (0, 1)))
        object.__setattr__(self, "texels", padded[..., :3])
        object.__setattr__(self, "rows", padded.reshape(-1, 4))

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Values (3, N) at texture coordinates (2, N) of any size."""
        del footprints
        height, width = self.texels.shape[:2]
        x, y = self._texel(coordinates[0], width), self._texel(coordinates[1], height)
        if self.filter == "nearest":
            return self._fetch(self._row(np.floor(y)), self._column(np.floor(x)))
        return self._bilinear(x - 0.5, y - 0.5)

    def _texel(self, coordinate: Floats, size: int) -> Floats:
        """Place in texels, reduced to two periods first so that a large coordinate keeps its digits."""
        if self.wrap == "clamp":
            # Beyond a period to either side nothing changes, and whole numbers stay small enough for int64.
            return np.clip(coordinate, -1.0, 2.0) * size
        return (coordinate - 2 * np.floor(coordinate / 2)) * size

    def _column(self, x: Floats) -> Integers:
        """Texels of a row by whole numbers; wrapping whole numbers never leaves the image."""
        return WRAPS[self.wrap](x.astype(np.int64), self.texels.shape[1])

    def _row(self, y: Floats) -> Integers:
        """First texels of rows by whole numbers."""
        height, width = self.texels.shape[:2]
        return WRAPS[self.wrap](y.astype(np.int64), height) * width

    def _fetch(self, row: Integers, column: Integers) -> Floats:
        texels = np.take(self.rows, row + column, axis=0)
        return texels.T[:3].astype(np.float64, order="C")

    def _bilinear(self, x: Floats, y: Floats) -> Floats:
        """Between four texels as a + f (b - a), which gives a constant image its constant exactly."""
        left, low = np.floor(x), np.floor(y)
        columns = self._column(left), self._column(left + 1)
        rows = self._row(low), self._row(low + 1)
        (a, b), (c, d) = ([self._fetch(row, column) for column in columns] for row in rows)
        return _between(_between(a, b, x - left), _between(c, d, x - left), y - low)


def _between(a: Floats, b: Floats, share: Floats) -> Floats:
    return a + share * (b - a)


def build(texture: language.ImageTexture, assets: AssetSource) -> ImageTexture:
    """Read and decode the texture's file.

    Raises
    ------
    AssetError
        If there is no such file, it is not a picture, or the encoding is not one of its numbers.
    """
    texels, bounds, notes = _read(texture, assets)
    # A view: the constructor copies it, and another copy would be the most memory that reading takes.
    return ImageTexture(texels[::-1], texture.filter, texture.wrap, bounds, notes)


def _read(
    texture: language.ImageTexture, assets: AssetSource
) -> tuple[NDArray[np.float32], tuple[float, float], tuple[str, ...]]:
    """Linear texels, row 0 on top, their bounds and notes; what was stored is given back to the system."""
    found = read_image(content_of(texture.asset, assets), limits_of(assets).max_image_pixels)
    if texture.encoding == "linear":
        return found.values, _bounds(found), found.notes
    if found.floating:
        raise AssetError(
            "This picture stores floating-point numbers, which are linear light: set "
            '"encoding": "linear" in this texture.'
        )
    return linear_from_srgb(found.values), _bounds(found), found.notes


def _bounds(found: DecodedImage) -> tuple[float, float]:
    if not found.floating:
        return 0.0, 1.0
    return min(0.0, float(found.values.min())), max(1.0, float(found.values.max()))
