"""What a tile looks like in the middle of a pass, before the whole picture is decided about."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.levels import COUNTS, SAMPLED
from renderer.adaptive.samples import LevelRequest, Samples
from renderer.film import Image
from renderer.math.arrays import Masks
from schemas.tiles import Tile


def preview(tile: Tile, samples: Samples, levels: LevelRequest, before: Image) -> Image:
    """The pixels of a tile with what a pass has found there.

    What the first pass finds fills the squares of its lattice, later samples join those that a pixel shows.
    Differences from a control variate, whose mean is not here, are seen when the pass is merged.

    Parameters
    ----------
    tile : Tile
    samples : Samples
        Of `render_samples` with the same levels.
    levels : LevelRequest
    before : (h, w, 3) float32
        The tile as it looked before the pass.

    Returns
    -------
    (h, w, 3) float32
    """
    image = before.copy()
    previewed = levels.previewed
    if previewed.any():
        _fill(image, tile, previewed, samples.pilots)
    if not levels.have.any() and levels.sampled.any():
        _fill(image, tile, levels.sampled, samples.halves.mean(axis=0))
    plain = levels.have[levels.covered] < SAMPLED
    image[levels.covered & (levels.have < SAMPLED)] = samples.covers.T[plain]
    more = levels.sampled
    more[more] = ~samples.controlled
    first, last = COUNTS[levels.have[more]], COUNTS[levels.want[more]]
    share = ((last - first) / last)[:, None]
    image[more] += share * (samples.halves.mean(axis=0).T[~samples.controlled] - image[more])
    return image


def _fill(image: Image, tile: Tile, previewed: Masks, pilots: NDArray[np.float32]) -> None:
    """Paint pilot samples (3, n) over the squares that begin at their pixels."""
    rows, columns = np.nonzero(previewed)
    # New nodes of a lattice are odd multiples of its stride along one axis at least.
    places = np.concatenate((rows + tile.y0, columns + tile.x0))
    stride = int(np.gcd.reduce(places)) or max(tile.width, tile.height)
    nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
    colors = np.zeros((*previewed.shape, 3), dtype=np.float32)
    colors[previewed] = pilots.T
    part = image[-tile.y0 % stride :, -tile.x0 % stride :]
    inside = np.s_[: part.shape[0], : part.shape[1]]
    known = previewed[nodes].repeat(stride, axis=0).repeat(stride, axis=1)[inside]
    np.copyto(
        part, colors[nodes].repeat(stride, axis=0).repeat(stride, axis=1)[inside], where=known[:, :, None]
    )
