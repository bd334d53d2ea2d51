"""Partition of a picture into tiles of equal work.

Most passes of target quality work along edges and shadows alone, so tiles of equal size would take very
different times. A rectangle is cut in two across its longer side in proportion to the tiles that either part
is to make, and each part again.
"""

from math import ceil

import numpy as np

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.forecast import LAYERS, Prices, kind_of
from renderer.math.arrays import Floats
from renderer.tiling import tiles
from schemas.tiles import Pass, Tile

TILES_PER_WORKER = 4
"""Tiles for each worker, so that none waits long for the last tile of another."""

MIN_TILE_SECONDS, MAX_TILE_SECONDS = 0.015, 0.25
"""Least and most predicted CPU seconds of a tile: the calls of one of `soft` take 3 to 4 ms, viewers wait for
a tile, and a deadline may lose it."""

MAX_CELLS = 128
"""Most cells along the longer side of the picture, between which it is cut. Finding the cuts takes far less
than a tile."""


def pass_tiles(
    estimate: Estimate, prices: Prices, workers: int, tile_size: int | None, *, records: bool
) -> list[Tile]:
    """Tiles of the next pass that have work.

    Parameters
    ----------
    estimate : Estimate
    prices : dict
        Measured so far.
    workers : int
        Processes that share the pass; 0 if no one waits for single tiles.
    tile_size : int or None
        Side of the tiles, pixels; None for tiles of about equal work.
    records : bool
        Whether the pass records layers, of all pixels.
    """
    if tile_size:
        found = tiles(estimate.plan, Pass(index=0, stride=1, first=0, last=0), tile_size)
        more = estimate.requested.rising
        return [tile for tile in found if records or more[tile.y0 : tile.y1, tile.x0 : tile.x1].any()]
    layers = estimate.have.size * prices[LAYERS] if records else 0.0
    seconds = estimate.work_wanted() * prices[kind_of(estimate)] + layers
    count = max(
        ceil(seconds / MAX_TILE_SECONDS), min(TILES_PER_WORKER * workers, int(seconds / MIN_TILE_SECONDS)), 1
    )
    side, (height, width) = estimate.stride, estimate.have.shape
    while side * MAX_CELLS < max(width, height):
        side *= 2
    return partition(estimate.work_in_cells(side), side, width, height, count)


def partition(work: Floats, side: int, width: int, height: int, count: int) -> list[Tile]:
    """Cut a picture into about `count` tiles of about equal work.

    Parameters
    ----------
    work : (a, b) float64
        Of each cell, at least 0; cells of the last row and column may reach beyond the picture.
    side : int
        Of a cell, pixels.
    width, height : int
        Of the picture, pixels.
    count : int
        Most tiles; fewer where cells are too few or the work cannot be cut evenly.

    Returns
    -------
    list of Tile
        Disjoint, numbered from 0, row by row as far as cuts allow. They contain all cells with work.
    """
    cuts = _cut(work, (0, 0, work.shape[1], work.shape[0]), count)
    corners = sorted((y0, x0, y1, x1) for x0, y0, x1, y1 in cuts)
    return [
        Tile(index, x0 * side, y0 * side, min(x1 * side, width), min(y1 * side, height))
        for index, (y0, x0, y1, x1) in enumerate(corners)
    ]


Cells = tuple[int, int, int, int]
"""A rectangle of cells: x0, y0, x1, y1."""


def _cut(work: Floats, cells: Cells, count: int) -> list[Cells]:
    x0, y0, x1, y1 = cells
    part = work[y0:y1, x0:x1]
    total = part.sum()
    if total <= 0:
        return []
    along_x = x1 - x0 >= y1 - y0
    size = x1 - x0 if along_x else y1 - y0
    if count <= 1 or size == 1:
        return [cells]
    below = np.cumsum(part.sum(axis=0 if along_x else 1))
    half = count // 2 / count * total
    at = int(np.clip(np.argmin(np.abs(below - half)) + 1, 1, size - 1))
    first = int(np.clip(np.rint(count * below[at - 1] / total), 1, count - 1))
    if along_x:
        parts = (x0, y0, x0 + at, y1), (x0 + at, y0, x1, y1)
    else:
        parts = (x0, y0, x1, y0 + at), (x0, y0 + at, x1, y1)
    return _cut(work, parts[0], first) + _cut(work, parts[1], count - first)
