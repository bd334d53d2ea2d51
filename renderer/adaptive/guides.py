"""Control variates from the pilot samples around a pixel: by shape at borders, by texture colour inside."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.labels import of_labels, of_lights
from renderer.film import BRIGHTEST
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Integers, Masks, put, taken
from schemas.tiles import Tile

RINGS = np.array([4]), np.array([1, 3, 5, 7]), np.array([0, 2, 6, 8])
"""Indices of the centre, the sides and the corners of three by three pixels, row by row."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Pilot samples of the three by three pixels around each of n pixels, row by row.

    Attributes
    ----------
    values : (3, 9, n) float32
    labels : (9, n) int32
    colors, others : (3, n) float32
        Of the pixels, as in `Surroundings`.
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    others: NDArray[np.float32]

    def contrasts(self) -> Floats:
        """Expected squared error (n,) of one ray as an estimate of the coverage, mean over channels."""
        shown = np.clip(self.values, 0, 1)
        return np.asarray(RAY_ERROR_RATIO * shown.var(axis=1, dtype=np.float64).mean(axis=0))

    def unevenness(self) -> Floats:
        """Expected squared error (n,) of the radiance of a pixel's parts, mean over channels."""
        shown = np.clip(self.values, 0, 1)
        same = self.labels[:, None] == self.labels
        means = np.einsum("jkn,ckn->cjn", same, shown) / same.sum(axis=1, dtype=np.uint8)
        return np.asarray(UNEVENNESS_RATIO * ((shown - means) ** 2).mean(axis=(0, 1), dtype=np.float64))

    def filled_by(self, shapes: Masks) -> Masks:
        """Mask of the pixels (n,) that one of some `shapes` (K,) fills."""
        return of_labels(shapes, self.labels[4]) & (self.labels == self.labels[4]).all(axis=0)

    def radiance_of(self, labels: NDArray[np.int32], pixels: Integers, fine: Masks, lights: Floats) -> Floats:
        """Control variate of border pixels: the radiance (3, m) of what rays through `pixels` (m,) have hit.

        Pilot samples nearby represent the `labels` (m,) of the rays, unless a shape has `fine` (K,) detail.
        Visible `lights` (3, L) have a radiance of their own.
        """
        same = self.labels[:, pixels] == labels
        same &= ~of_labels(fine, labels) | same[4]
        found = np.where(
            same.any(axis=0), self._means()[:, same.argmax(axis=0), pixels], self.others[:, pixels]
        )
        lit = np.flatnonzero(of_lights(labels))
        put(found, lit, np.minimum(taken(lights, MISS - 1 - labels[lit].astype(np.int64)), BRIGHTEST))
        return found

    def _means(self) -> Floats:
        """Mean radiance (3, 9, n) of the pilot samples with the label of each of the nine.

        The pixel's own has precedence over those beside it, and these over those at its corners.
        """
        found = np.zeros(self.values.shape)
        missing = np.ones(self.labels.shape, dtype=bool)
        same = self.labels[:, None] == self.labels
        for ring in RINGS:
            times = same[:, ring].sum(axis=1, dtype=np.uint8)
            fresh = missing & (times > 0)
            sums = np.einsum("jkn,ckn->cjn", same[:, ring], self.values[:, ring])
            np.divide(sums, times, out=found, where=fresh)
            missing &= ~fresh
        return found

    def textured(self, labels: NDArray[np.int32], pixels: Integers, colors: Floats) -> Floats:
        """Control variate of pixels that a texture fills: `colors` (3, m) of rays in the light of its centre.

        Rays through `pixels` (m,) that hit another shape, which no pilot sample has hit, get the mean.
        """
        values, means = self.values[:, 4].astype(np.float64), self.colors.astype(np.float64)
        light = values / np.maximum(means, MIN_ALBEDO)
        # As a difference from the mean: the highlight of a dark, glossy surface follows no colour.
        away = (colors - means[:, pixels]) * (self.labels[4, pixels] == labels)
        return values[:, pixels] + away * light[:, pixels]


UNEVENNESS_RATIO = 1 / 8
"""Expected squared error of a pilot sample over the variance of those around with the same label: on an even
slope the variance within a pixel is 1 / 12, that among three pixels in a row 2 / 3."""

RAY_ERROR_RATIO = 0.3
"""Squared error of one ray as an estimate of the coverage, over the variance among the pilot samples around:
the mean over the borders of `soft`, `chess` and `lamp`."""


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
        values = np.stack([np.take(channel, numbers) for channel in self.values])
        own = np.s_[:, rows + self.top, columns + self.left]
        return Nearby(values, np.take(self.labels, numbers), self.colors[own], self.others[own])

    def with_others(self, rows: Integers, columns: Integers, others: NDArray[np.float32]) -> "Surroundings":
        """A copy with `others` (3, n) in pixels (n,) of the tile."""
        found = self.others.copy()
        found[:, rows + self.top, columns + self.left] = others
        return replace(self, others=found)


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
