"""Blocks and pixels of a pilot, in an order whose prefixes all cover the picture evenly."""

from collections.abc import Iterator

import numpy as np

from renderer.tiling import Block
from schemas.tiles import Tile

ACROSS, DOWN = 0.7548776662466927, 0.5698402909980532
"""Powers of the root of x^3 = x + 1, whose multiples fill a square evenly (Roberts 2018)."""

SMALL_BLOCK_SIDE = 32
"""Side of small blocks, pixels: a thousand rays cost much more than the overhead of calls."""

PIXEL_SPACING = 4
"""One pixel is sampled in each square of this side, pixels: neighbours are similar, and blocks of many pixels
cost less per pixel."""


def cells(width: int, height: int, side: int, seed: int) -> Iterator[Tile]:
    """The picture in squares, smaller ones at its right and lower edges, each once.

    They come in the order of a rank-1 lattice with a random start: those whose fractional part is below any
    limit are evenly distributed (a Bohr set).
    """
    rows, columns = np.indices((-(-height // side), -(-width // side))).reshape(2, -1)
    begin = np.random.default_rng(seed).random()
    order = np.argsort((columns * ACROSS + rows * DOWN + begin) % 1)
    for i, (column, row) in enumerate(zip(columns[order], rows[order], strict=True)):
        x, y = side * int(column), side * int(row)
        yield Tile(i, x, y, min(x + side, width), min(y + side, height))


def parts(cell: Tile, side: int, seed: int) -> list[Tile]:
    """The squares of a cell, smaller ones at its right and lower edges, in random order."""
    found = [
        Tile(0, x, y, min(x + side, cell.x1), min(y + side, cell.y1))
        for y in range(cell.y0, cell.y1, side)
        for x in range(cell.x0, cell.x1, side)
    ]
    return [found[at] for at in np.random.default_rng((seed, cell.index)).permutation(len(found))]


def scattered(cell: Tile, seed: int) -> Block:
    """Pixels of a cell drawn at random, one in each square of `PIXEL_SPACING` x `PIXEL_SPACING` pixels.

    Squares at the edges of the picture may be smaller, but count as one.
    """
    x0, y0 = np.arange(cell.x0, cell.x1, PIXEL_SPACING), np.arange(cell.y0, cell.y1, PIXEL_SPACING)
    wide, high = np.minimum(PIXEL_SPACING, cell.x1 - x0), np.minimum(PIXEL_SPACING, cell.y1 - y0)
    across, down = np.random.default_rng((seed, cell.index)).random((2, y0.size, x0.size))
    columns = (x0 + across * wide).astype(np.int64)
    rows = (y0[:, None] + down * high[:, None]).astype(np.int64)
    return Block(columns.ravel(), rows.ravel(), (cell.x0, cell.y0, cell.x1, cell.y1))
