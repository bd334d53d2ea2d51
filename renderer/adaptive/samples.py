"""Samples of a tile, and the tile's preview before the pass is merged."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.levels import COUNTS, SAMPLED
from renderer.adaptive.requests import LevelRequest
from renderer.film import Image
from renderer.layers import Layers
from renderer.math.arrays import Masks
from schemas.tiles import Tile


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Results of a pass for a tile, pixels in row-major order.

    Pilot samples of pixels that were at level 0, coverage of border pixels, samples of pixels that continue.

    Attributes
    ----------
    pilots : (3, n) float32
    labels : (n,) int32
        Of the pilot samples' hits: a shape's number, -1 for the background, -2 and below for lights.
    colors : (3, n) float32
        Texture colours at the pilot samples, 1 without a texture.
    shading_errors : (n,) float32
        Expected squared errors of pilot samples that shade fine texture at a few points.
    covers, others : (3, k) float32
    coverage_variance : (k,) float32
        Of border pixels (`coverage.cover`).
    halves : (2, 3, m) float32
        Means of the new samples of either half, or of their differences from a control variate.
    squares : (m,) float32
        Sum over the same of squares about their mean, mean over channels.
    controlled : (m,) bool
        Whether these are differences from a control variate.
    counts, work : dict
    cpu_seconds : float
        As in `TileResult`.
    layers : dict of str to array
        Recorded at the centres of pixels, in the first pass only.
    layer_seconds : float
        CPU seconds of recording them.
    """

    pilots: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    shading_errors: NDArray[np.float32]
    covers: NDArray[np.float32]
    others: NDArray[np.float32]
    coverage_variance: NDArray[np.float32]
    halves: NDArray[np.float32]
    squares: NDArray[np.float32]
    controlled: Masks
    counts: dict[str, int]
    work: dict[str, int]
    cpu_seconds: float
    layers: Layers = field(default_factory=dict)
    layer_seconds: float = 0.0


def preview(tile: Tile, samples: Samples, levels: LevelRequest, before: Image) -> Image:
    """The picture of a tile with the results of an unmerged pass.

    Nodes of the first pass fill the squares of their lattice; later samples are averaged with earlier ones.
    Differences from a control variate, whose mean is not known here, wait for the pass to be merged.

    Parameters
    ----------
    tile : Tile
    samples : Samples
        Of `render_samples` with the same levels.
    levels : LevelRequest
    before : (h, w, 3) float32
        The tile before the pass.

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
