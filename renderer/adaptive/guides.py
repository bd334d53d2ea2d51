"""How bright the things are that a pixel may show, from the pilot samples around it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import of_labels, of_lights
from renderer.film import BRIGHTEST
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Integers, Masks, put, taken
from schemas.tiles import Tile

CENTRE, BESIDE, CORNERS = np.array([4]), np.array([1, 3, 5, 7]), np.array([0, 2, 6, 8])
"""Places among a pixel and its eight neighbours, row by row."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Pilot samples of pixels and their eight neighbours, row by row.

    Attributes
    ----------
    values : (3, 9, n) float32
    labels : (9, n) int32
    others : (3, n) float32
        Of the pixels, as `Surroundings` has them.
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]
    others: NDArray[np.float32]

    def contrasts(self) -> Floats:
        """Squared error (n,) to expect of one ray that finds what a pixel shows, mean over channels."""
        shown = np.clip(self.values, 0, GLARING)
        return np.asarray(UNLIKE * shown.var(axis=1, dtype=np.float64).mean(axis=0))

    def unevenness(self) -> Floats:
        """Squared error (n,) to expect of the brightness of what a pixel shows, mean over channels."""
        shown = np.clip(self.values, 0, 1)
        same = self.labels[:, None] == self.labels
        means = np.einsum("jkn,ckn->cjn", same, shown) / same.sum(axis=1, dtype=np.uint8)
        return np.asarray(UNEVEN * ((shown - means) ** 2).mean(axis=(0, 1), dtype=np.float64))


UNEVEN = 1 / 8
"""Expected squared error of a pilot sample, over the variance of those around that show the same: on an even
slope the variance within a pixel is 1 / 12, that among three pixels in a row 2 / 3."""

UNLIKE = 0.3
"""Squared error of one ray that finds what a pixel shows, over the variance among its pilot sample and the
eight around: the mean over the borders of `soft`, `chess` and `lamp`."""

GLARING = 4.0
"""Brightness above which more contrast asks for no more rays: everything shows as white."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Pilot samples of a tile and, within the picture, of the pixels around it.

    Attributes
    ----------
    values : (3, h, w) float32
    labels : (h, w) int32
    colors : (3, h, w) float32
        Means of textures over the pixels, 1 where there is none.
    others : (3, h, w) float32
        Radiance of what borders show and no pilot sample around has hit; NaN where they are not covered yet.
    top, left : int
        Rows above the tile, and columns at its left: 1, or 0 at the rim of the picture.
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    others: NDArray[np.float32]
    top: int
    left: int

    def nearby(self, rows: Integers, columns: Integers) -> Nearby:
        """Those around pixels (n,) of the tile; beyond the picture those at its rim once more."""
        height, width = self.labels.shape
        y = (rows + (np.repeat(np.arange(-1, 2), 3) + self.top)[:, None]).clip(0, height - 1)
        x = (columns + (np.tile(np.arange(-1, 2), 3) + self.left)[:, None]).clip(0, width - 1)
        numbers = y * width + x
        flat = (np.take(channel, numbers) for channel in self.values)
        others = self.others[:, rows + self.top, columns + self.left]
        return Nearby(np.stack(tuple(flat)), np.take(self.labels, numbers), others)

    def with_others(self, rows: Integers, columns: Integers, others: NDArray[np.float32]) -> "Surroundings":
        """The same with those (3, n) that have been found in pixels (n,) of the tile."""
        found = self.others.copy()
        found[:, rows + self.top, columns + self.left] = others
        return replace(self, others=found)

    def tints(self, rows: Integers, columns: Integers, averaged: Masks) -> "Tints":
        """What pixels (n,) show all over that have a texture whose mean is known."""
        labels = self.nearby(rows, columns).labels
        tinted = np.flatnonzero(of_labels(averaged, labels[4]) & (labels == labels[4]).all(axis=0))
        y, x = rows[tinted] + self.top, columns[tinted] + self.left
        values = self.values[:, y, x].astype(np.float64)
        colors = self.colors[:, y, x].astype(np.float64)
        return Tints(tinted, labels[4][tinted], values, colors, values / np.maximum(colors, DARKEST))


Around = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]
"""Values, labels, colours and others of a whole picture, as `Surroundings` has them."""


def surroundings(tile: Tile, around: Around) -> Surroundings:
    """Views of the pilot samples around a tile of a picture."""
    values, labels, colors, others = around
    y0, x0 = max(tile.y0 - 1, 0), max(tile.x0 - 1, 0)
    part = np.s_[y0 : tile.y1 + 1, x0 : tile.x1 + 1]
    views = values[:, *part], labels[part], colors[:, *part], others[:, *part]
    return Surroundings(*views, tile.y0 - y0, tile.x0 - x0)


def packed(around: Around) -> NDArray[np.float32]:
    """Pilot samples of a picture in one array (10, H, W), for `unpacked`; labels keep their bits."""
    values, labels, colors, others = around
    return np.concatenate((values, colors, others, labels.view(np.float32)[None]))


def unpacked(tile: Tile, pilots: NDArray[np.float32]) -> Surroundings:
    """`surroundings` of what `packed` gave."""
    others = pilots[6:9] if len(pilots) == 10 else np.zeros_like(pilots[:3])  # As in version 0.1.0.
    return surroundings(tile, (pilots[:3], pilots[-1].view(np.int32), pilots[3:6], others))


DARKEST = 2.0**-10
"""Darker textures count as this bright, so that the light on them can be estimated."""


@dataclass(frozen=True, slots=True, eq=False)
class Tints:
    """The control variate of pixels filled by a textured shape: its colour in the light of the pilot sample.

    Attributes
    ----------
    pixels : (k,) int64
        Which of the pixels they are.
    labels : (k,) int32
    values, colors : (3, k) float64
        Means of the control variate, and of the texture over the pixel.
    light : (3, k) float64
        What a colour adds to the control variate.
    """

    pixels: Integers
    labels: NDArray[np.int32]
    values: Floats
    colors: Floats
    light: Floats

    def at(self, which: Integers, labels: NDArray[np.int32], colors: Floats) -> Floats:
        """Control (3, m) of rays through pixels `which` (m,) of these, that hit `colors` (3, m).

        Where something that no pilot sample has hit hides the shape, its colour is not known: the mean
        stands for it.
        """
        # As a difference from the mean: what is dark but glossy has light that no colour predicts.
        away = (colors - self.colors[:, which]) * (self.labels[which] == labels)
        return self.values[:, which] + away * self.light[:, which]


@dataclass(frozen=True, slots=True, eq=False)
class Guide:
    """Brightness of each thing that n pixels may show.

    The control variate of pixels at borders: a function of what a ray hits alone, whose mean over a pixel is
    a matter of visibility.

    Attributes
    ----------
    labels : (9, n) int32
    radiance : (3, 9, n) float64
        Of what is at each of nine places; alike where labels are.
    known : (9, n) bool
        Whether a place says how bright its label is.
    lights : (3, lights of the scene) float64
        Radiance of the lights, which no pilot sample has to hit.
    others : (3, n) float32
        Of everything else; NaN where that is not known yet.
    """

    labels: NDArray[np.int32]
    radiance: Floats
    known: Masks
    lights: Floats
    others: NDArray[np.float32]

    def at(self, labels: NDArray[np.int32], pixels: Integers) -> Floats:
        """Radiance (3, m) of what rays through pixels (m,) of those n have hit."""
        same = (self.labels[:, pixels] == labels) & self.known[:, pixels]
        found = self.radiance[:, same.argmax(axis=0), pixels]
        found = np.where(same.any(axis=0), found, self.others[:, pixels])
        lights = np.flatnonzero(of_lights(labels))
        put(found, lights, taken(self.lights, MISS - 1 - labels[lights].astype(np.int64)))
        return found


def guide(nearby: Nearby, fine: Masks, lights: Floats) -> Guide:
    """Brightness by label around n pixels, and that of all `lights` (3, K).

    The pixel's own pilot sample is taken before the mean of those beside it, and that before those at its
    corners; of what is `fine` (shapes,) no neighbour's.
    """
    labels, values = nearby.labels, nearby.values
    found = np.zeros(values.shape)
    missing = np.ones(labels.shape, dtype=bool)
    same = labels[:, None] == labels
    for ring in (CENTRE, BESIDE, CORNERS):
        times = same[:, ring].sum(axis=1, dtype=np.uint8)
        fresh = missing & (times > 0)
        sums = np.einsum("jkn,ckn->cjn", same[:, ring], values[:, ring])
        np.divide(sums, times, out=found, where=fresh)
        missing &= ~fresh
    known = ~of_labels(fine, labels) | (labels == labels[CENTRE])
    return Guide(labels, found, known, np.minimum(lights, BRIGHTEST), nearby.others)
