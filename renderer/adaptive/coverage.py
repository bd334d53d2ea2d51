"""Pixels at borders: many rays tell what they show, and first looks nearby how bright that is.

What differs inside such a pixel is mostly which shape is seen, and little how bright each of them is. So the
rays do no more than find shapes. What no neighbour's first look has met is looked at in its middle.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.camera_rays import camera_rays
from renderer.adaptive.halves import HALVES
from renderer.adaptive.labels import labels_of, of_labels
from renderer.arrays import Floats, Integers, Masks, put
from renderer.execute import radiance
from renderer.film import BRIGHTEST
from renderer.lights.emitters import PIXEL_DIMENSIONS
from renderer.plan import RenderPlan
from renderer.streams import bits, keys, uniforms
from schemas.tiles import Tile

SIZES = {5: 3, 8: 5, 13: 8, 21: 13, 34: 21, 55: 34, 89: 55, 144: 89, 233: 144}
"""Fibonacci lattices: point i of n lies at (i / n, i z / n), with z the number before n. No direction of an
edge goes well with one of them."""

ENOUGH = 21, 2.0**-8
"""So many rays see an error of so much at borders; fewer or more by its inverse to the power 4 / 3, as the
error of a share of a pixel falls like their number to the power -3 / 4."""

UNEVEN = 1 / 8
"""Squared error to expect of a look where those around have a variance: less on a slope, more at an edge."""

RINGS = (np.array([4]), np.array([1, 3, 5, 7]), np.array([0, 2, 6, 8]))
"""Places in `Nearby`: the pixel itself, those beside it, and those at its corners."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """First looks at pixels and their eight neighbours, row by row.

    Attributes
    ----------
    values : (3, 9, n) float32
    labels : (9, n) int32
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """First looks at a tile and the pixels around it; beyond the picture those at its rim once more.

    Attributes
    ----------
    values : (3, h + 2, w + 2) float32
    labels : (h + 2, w + 2) int32
    """

    values: NDArray[np.float32]
    labels: NDArray[np.int32]

    def nearby(self, rows: Integers, columns: Integers) -> Nearby:
        """Those around pixels (n,) of the tile."""
        y = rows + np.repeat(np.arange(3), 3)[:, None]
        x = columns + np.tile(np.arange(3), 3)[:, None]
        return Nearby(self.values[:, y, x], self.labels[y, x])


def surroundings(tile: Tile, values: NDArray[np.float32], labels: NDArray[np.int32]) -> Surroundings:
    """First looks around a tile of a picture (3, H, W) and (H, W)."""
    height, width = labels.shape
    y = np.arange(tile.y0 - 1, tile.y1 + 1).clip(0, height - 1)[:, None]
    x = np.arange(tile.x0 - 1, tile.x1 + 1).clip(0, width - 1)
    return Surroundings(values[:, y, x], labels[y, x])


@dataclass(frozen=True, slots=True, eq=False)
class Cover:
    """What n pixels show.

    Attributes
    ----------
    values : (3, n) float32
        Mean radiance.
    doubts : (n,) float32
        Squared error to expect of it, clipped to 0..1, mean over channels, because shares are not exact.
    """

    values: NDArray[np.float32]
    doubts: NDArray[np.float32]


def size_for(error: float) -> int:
    """How many rays a pixel at a border gets where some error is wished for."""
    count, at = ENOUGH
    wished = count * (at / error) ** (4 / 3)
    return min(SIZES, key=lambda size: abs(np.log(size / wished)))


def places(seed: int, pixels: Integers, count: int) -> tuple[Floats, Floats]:
    """Places in pixels (n,), (n, count) each in [0, 1): a lattice, shifted by chance in each pixel.

    Its stream is the one after those of the halves of samples.
    """
    key = keys(seed, PIXEL_DIMENSIONS, pixels, HALVES)
    index = np.arange(count)
    across = index / count + uniforms(bits(key, 0))[:, None]
    along = index * SIZES[count] / count + uniforms(bits(key, 1))[:, None]
    return across - np.floor(across), along - np.floor(along)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """What pixels show: m parts, those of one pixel together.

    Attributes
    ----------
    pixels : (m,) int64
        Which of the pixels.
    shares : (m,) float64
        Of the pixel.
    rays : (m,) int64
        The ray nearest to the middle of the part.
    """

    pixels: Integers
    shares: Floats
    rays: Integers


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """What first looks tell of m parts.

    Attributes
    ----------
    radiance : (3, m) float64
    variances : (m,) float64
        Among the looks around that show the same thing, clipped to 0..1, mean over channels.
    missing : (k,) int64
        Parts that no look has met.
    """

    radiance: Floats
    variances: Floats
    missing: Integers


def cover(
    look: RenderPlan, count: int, x: Integers, y: Integers, nearby: Nearby, counts: Counter[str]
) -> Cover:
    """Look at pixels (n,) with `count` rays each."""
    across, along = places(look.seed, y * look.width + x, count)
    every = np.full(count * x.size, HALVES)
    rays = camera_rays(look, x.repeat(count), y.repeat(count), every, (across.ravel(), along.ravel()))
    for stage in (*look.meetings, *look.visible_lights):
        stage.run(rays)
    counts["camera"] += rays.t.size
    parts = _parts(rays.shapes.reshape(-1, count), across, along)
    known = _known(parts, labels_of(rays.shapes[parts.rays]), nearby, look.rough | look.textured)
    pixels, chosen = parts.pixels[known.missing], parts.rays[known.missing]
    if chosen.size:
        there = (across.ravel()[chosen], along.ravel()[chosen])
        seen = camera_rays(look, x[pixels], y[pixels], every[chosen], there)
        put(known.radiance, known.missing, np.minimum(radiance(look, seen, counts), BRIGHTEST))
    return _cover(parts, known, count)


def _cover(parts: _Parts, known: _Known, count: int) -> Cover:
    """Means of pixels from the radiance of their parts."""
    starts = np.flatnonzero(np.diff(parts.pixels, prepend=-1))
    values = np.add.reduceat(known.radiance * parts.shares, starts, axis=1)
    shown = np.clip(known.radiance, 0, 1)
    mean = np.add.reduceat(shown * parts.shares, starts, axis=1)
    apart = ((shown - mean[:, parts.pixels]) ** 2).mean(axis=0)
    doubts = (apart * count**-1.5 + UNEVEN * known.variances) * parts.shares
    return Cover(values.astype(np.float32), np.add.reduceat(doubts, starts).astype(np.float32))


def _known(parts: _Parts, labels: NDArray[np.int32], nearby: Nearby, fine: Masks) -> _Known:
    """What first looks tell of parts.

    The pixel's own look is taken before the mean of those beside it, and that before those at its corners;
    of what is `fine` (shapes,) no neighbour's. All of them tell how much it varies: a shadow may end here.
    """
    alike = nearby.labels[:, parts.pixels] == labels
    same = alike & (~of_labels(fine, labels) | (np.arange(9) == RINGS[0])[:, None])
    values = nearby.values[:, :, parts.pixels] * alike
    found = np.zeros((3, labels.size))
    missing = np.ones(labels.size, dtype=bool)
    for ring in RINGS:
        times = same[ring].sum(axis=0, dtype=np.uint8)
        met = np.flatnonzero(missing & (times > 0))
        put(found, met, (values[:, ring] * same[ring])[:, :, met].sum(axis=1) / times[met])
        missing[met] = False
    times = np.maximum(alike.sum(axis=0, dtype=np.uint8), 1)
    np.clip(values, 0, 1, out=values)
    variances = (values**2).sum(axis=1) / times - (values.sum(axis=1) / times) ** 2
    return _Known(found, np.maximum(variances.mean(axis=0), 0), np.flatnonzero(missing))


def _parts(shapes: Integers, across: Floats, along: Floats) -> _Parts:
    """Parts of n pixels by what their rays meet, all (n, count)."""
    count = shapes.shape[1]
    order = np.argsort(shapes, axis=1, kind="stable")
    sorted_shapes = np.take_along_axis(shapes, order, axis=1)
    fresh = np.ones(shapes.shape, dtype=bool)
    fresh[:, 1:] = sorted_shapes[:, 1:] != sorted_shapes[:, :-1]
    starts = np.flatnonzero(fresh)
    sizes = np.diff(starts, append=shapes.size)
    rays = (order + np.arange(shapes.shape[0])[:, None] * count).ravel()
    away = np.zeros(shapes.size)
    for along_axis in (across, along):
        there = along_axis.ravel()[rays]
        middle = np.add.reduceat(there, starts) / sizes
        away += (there - middle.repeat(sizes)) ** 2
    nearest = np.minimum.reduceat(away, starts).repeat(sizes) == away
    first = np.flatnonzero(nearest)
    which = np.searchsorted(first, starts)
    return _Parts(starts // count, sizes / count, rays[first[which]])
