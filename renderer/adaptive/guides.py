"""Control variates from the pilot samples around a pixel: by shape at borders, by texture colour inside."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import of_labels, of_lights
from renderer.film import BRIGHTEST
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Integers, Masks, put, taken
from schemas.tiles import Tile

CENTER, BESIDE, CORNERS = np.array([4]), np.array([1, 3, 5, 7]), np.array([0, 2, 6, 8])
"""Indices into the three by three pixels around a pixel, row by row."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Pilot samples of the three by three pixels around each of n pixels, row by row.

    Attributes
    ----------
    values : (3, 9, n) float32
    labels : (9, n) int32
    others : (3, n) float32
        Of the pixels, as in `Surroundings`.
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]
    others: NDArray[np.float32]

    def contrasts(self) -> Floats:
        """Expected squared error (n,) of one ray as an estimate of the coverage, mean over channels."""
        shown = np.clip(self.values, 0, MAX_BRIGHTNESS)
        return np.asarray(RAY_ERROR_RATIO * shown.var(axis=1, dtype=np.float64).mean(axis=0))

    def unevenness(self) -> Floats:
        """Expected squared error (n,) of the radiance of a pixel's parts, mean over channels."""
        shown = np.clip(self.values, 0, 1)
        same = self.labels[:, None] == self.labels
        means = np.einsum("jkn,ckn->cjn", same, shown) / same.sum(axis=1, dtype=np.uint8)
        return np.asarray(UNEVENNESS_RATIO * ((shown - means) ** 2).mean(axis=(0, 1), dtype=np.float64))


UNEVENNESS_RATIO = 1 / 8
"""Expected squared error of a pilot sample over the variance of those around with the same label: on an even
slope the variance within a pixel is 1 / 12, that among three pixels in a row 2 / 3."""

RAY_ERROR_RATIO = 0.3
"""Squared error of one ray as an estimate of the coverage, over the variance among the pilot samples around:
the mean over the borders of `soft`, `chess` and `lamp`."""

MAX_BRIGHTNESS = 4.0
"""Brightness above which contrast requests no further rays, as everything displays white."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Pilot samples of a tile and of the pixels around it within the picture.

    Attributes
    ----------
    values : (3, h, w) float32
    labels : (h, w) int32
    colors : (3, h, w) float32
        Means of textures over the pixels, 1 without a texture.
    others : (3, h, w) float32
        Radiance of what border pixels show and no pilot sample around has hit; NaN before they are covered.
    top, left : int
        Rows above the tile and columns to its left: 1, or 0 at the rim of the picture.
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    others: NDArray[np.float32]
    top: int
    left: int

    def nearby(self, rows: Integers, columns: Integers) -> Nearby:
        """Pilot samples around pixels (n,) of the tile; the rim of the picture is repeated beyond it."""
        height, width = self.labels.shape
        y = (rows + (np.repeat(np.arange(-1, 2), 3) + self.top)[:, None]).clip(0, height - 1)
        x = (columns + (np.tile(np.arange(-1, 2), 3) + self.left)[:, None]).clip(0, width - 1)
        numbers = y * width + x
        flat = (np.take(channel, numbers) for channel in self.values)
        others = self.others[:, rows + self.top, columns + self.left]
        return Nearby(np.stack(tuple(flat)), np.take(self.labels, numbers), others)

    def with_others(self, rows: Integers, columns: Integers, others: NDArray[np.float32]) -> "Surroundings":
        """A copy with `others` (3, n) in pixels (n,) of the tile."""
        found = self.others.copy()
        found[:, rows + self.top, columns + self.left] = others
        return replace(self, others=found)

    def texture_control(self, rows: Integers, columns: Integers, averaged: Masks) -> "TextureControl":
        """Control variate of those among pixels (n,) that one texture with a known mean fills."""
        labels = self.nearby(rows, columns).labels
        tinted = np.flatnonzero(of_labels(averaged, labels[4]) & (labels == labels[4]).all(axis=0))
        y, x = rows[tinted] + self.top, columns[tinted] + self.left
        values = self.values[:, y, x].astype(np.float64)
        colors = self.colors[:, y, x].astype(np.float64)
        return TextureControl(
            tinted, labels[4][tinted], values, colors, values / np.maximum(colors, MIN_ALBEDO)
        )


Around = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]
"""Values, labels, colours and others of a whole picture, as in `Surroundings`."""


def surroundings(tile: Tile, around: Around) -> Surroundings:
    """View the pilot samples around a tile of a picture."""
    values, labels, colors, others = around
    y0, x0 = max(tile.y0 - 1, 0), max(tile.x0 - 1, 0)
    part = np.s_[y0 : tile.y1 + 1, x0 : tile.x1 + 1]
    views = values[:, *part], labels[part], colors[:, *part], others[:, *part]
    return Surroundings(*views, tile.y0 - y0, tile.x0 - x0)


def packed(around: Around) -> NDArray[np.float32]:
    """Pack the pilot samples of a picture into one array (10, H, W); labels keep their bits."""
    values, labels, colors, others = around
    return np.concatenate((values, colors, others, labels.view(np.float32)[None]))


def unpacked(tile: Tile, pilots: NDArray[np.float32]) -> Surroundings:
    """View the pilot samples around a tile in an array of `packed`."""
    others = pilots[6:9] if len(pilots) == 10 else np.zeros_like(pilots[:3])  # As in version 0.1.0.
    return surroundings(tile, (pilots[:3], pilots[-1].view(np.int32), pilots[3:6], others))


MIN_ALBEDO = 2.0**-10
"""Least albedo by which radiance is divided for an estimate of the light."""


@dataclass(frozen=True, slots=True, eq=False)
class TextureControl:
    """Control variate of pixels that one textured shape fills: its colour in the light of the pilot sample.

    Attributes
    ----------
    pixels : (k,) int64
        Indices of these pixels.
    labels : (k,) int32
    values, colors : (3, k) float64
        Means over the pixel of the control variate and of the texture.
    light : (3, k) float64
        Derivative of the control variate by the colour.
    """

    pixels: Integers
    labels: NDArray[np.int32]
    values: Floats
    colors: Floats
    light: Floats

    def at(self, which: Integers, labels: NDArray[np.int32], colors: Floats) -> Floats:
        """Control variate (3, m) of rays through pixels `which` (m,) of these that hit `colors` (3, m).

        Rays that hit another shape, which no pilot sample has hit, get the mean.
        """
        # As a difference from the mean: the highlight of a dark, glossy surface follows no colour.
        away = (colors - self.colors[:, which]) * (self.labels[which] == labels)
        return self.values[:, which] + away * self.light[:, which]


@dataclass(frozen=True, slots=True, eq=False)
class Guide:
    """Control variate of n border pixels: the radiance of each label, whose mean is a matter of visibility.

    Attributes
    ----------
    labels : (9, n) int32
    radiance : (3, 9, n) float64
        Of the label at each of the nine pixels.
    known : (9, n) bool
        Whether the radiance is representative of the label.
    lights : (3, lights of the scene) float64
        Radiance of visible lights, independent of pilot samples.
    others : (3, n) float32
        Of all other labels; NaN before it is known.
    """

    labels: NDArray[np.int32]
    radiance: Floats
    known: Masks
    lights: Floats
    others: NDArray[np.float32]

    def at(self, labels: NDArray[np.int32], pixels: Integers) -> Floats:
        """Radiance (3, m) of the labels (m,) that rays through pixels (m,) of these have hit."""
        same = (self.labels[:, pixels] == labels) & self.known[:, pixels]
        found = self.radiance[:, same.argmax(axis=0), pixels]
        found = np.where(same.any(axis=0), found, self.others[:, pixels])
        lights = np.flatnonzero(of_lights(labels))
        put(found, lights, taken(self.lights, MISS - 1 - labels[lights].astype(np.int64)))
        return found


def guide(nearby: Nearby, fine: Masks, lights: Floats) -> Guide:
    """Control variate of n border pixels, with the radiance of all `lights` (3, K).

    The pixel's own pilot sample has precedence over the mean of those beside it, and that over those at its
    corners; neighbours of a shape with `fine` (shapes,) detail are not representative.
    """
    labels, values = nearby.labels, nearby.values
    found = np.zeros(values.shape)
    missing = np.ones(labels.shape, dtype=bool)
    same = labels[:, None] == labels
    for ring in (CENTER, BESIDE, CORNERS):
        times = same[:, ring].sum(axis=1, dtype=np.uint8)
        fresh = missing & (times > 0)
        sums = np.einsum("jkn,ckn->cjn", same[:, ring], values[:, ring])
        np.divide(sums, times, out=found, where=fresh)
        missing &= ~fresh
    known = ~of_labels(fine, labels) | (labels == labels[CENTER])
    return Guide(labels, found, known, np.minimum(lights, BRIGHTEST), nearby.others)
