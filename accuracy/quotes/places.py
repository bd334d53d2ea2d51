"""Blocks and pixels of a pilot, in an order whose every beginning is spread over the picture."""

import numpy as np

from renderer.math import morton
from renderer.math.arrays import Integers
from renderer.tiling import Block
from schemas.tiles import Tile

SIDE = 64
"""Side of the blocks of the first sample, pixels: those that `tiling.blocks` makes of them."""

SMALL = 16
"""Side of the smallest blocks, pixels: smaller ones are all calls and no arithmetic."""

APART = 4
"""Side of the squares in each of which one pixel is sampled, pixels: neighbours show much the same, and
blocks of many pixels cost less for each."""


def spread(columns: int, rows: int, seed: int) -> list[tuple[int, int]]:
    """The cells of a grid, (column, row), each once, in an order whose every beginning is spread evenly.

    It is the order of a square twice as fine each time, begun anywhere: Morton's order of the places with
    their bits reversed.
    """
    bits = (max(columns, rows) - 1).bit_length()
    first = np.random.default_rng(seed).integers(0, 1 << bits, 2)
    row, column = np.indices((rows, columns)).reshape(2, -1)
    across, down = (
        _reversed_bits((at - by) % (1 << bits), bits) for at, by in zip((column, row), first, strict=True)
    )
    # The second coarsest cell is the one across, so that two cells show both halves either way.
    order = np.argsort(morton.codes(across, across ^ down))
    return list(zip(column[order].tolist(), row[order].tolist(), strict=True))


def _reversed_bits(numbers: Integers, bits: int) -> Integers:
    """Numbers below 2^bits with their lowest bit first."""
    reverse = np.zeros_like(numbers)
    for bit in range(bits):
        reverse |= (numbers >> bit & 1) << (bits - 1 - bit)
    return reverse


def cells(width: int, height: int, side: int, seed: int) -> list[Tile]:
    """The picture in squares, smaller ones at its right and lower edges, in the order of `spread`."""
    order = spread(-(-width // side), -(-height // side), seed)
    return [
        Tile(i, x * side, y * side, min((x + 1) * side, width), min((y + 1) * side, height))
        for i, (x, y) in enumerate(order)
    ]


def scattered(cell: Tile, seed: int) -> Block:
    """Pixels of a cell drawn at random, one in each square of `APART` x `APART` pixels.

    Squares at the edges of the picture may be smaller; each counts as one all the same.
    """
    x0, y0 = np.arange(cell.x0, cell.x1, APART), np.arange(cell.y0, cell.y1, APART)
    wide, high = np.minimum(APART, cell.x1 - x0), np.minimum(APART, cell.y1 - y0)
    across, down = np.random.default_rng((seed, cell.index)).random((2, y0.size, x0.size))
    columns = (x0 + across * wide).astype(np.int64)
    rows = (y0[:, None] + down * high[:, None]).astype(np.int64)
    return Block(columns.ravel(), rows.ravel(), (cell.x0, cell.y0, cell.x1, cell.y1))
