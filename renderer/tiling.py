"""Passes over the picture, its tiles, and the blocks inside a tile."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np

from renderer.math import morton
from renderer.math.arrays import Integers
from schemas.tiles import Pass, Tile

PREVIEW_PIXELS = 4096
"""About the most rays of a coarse preview: a few hundredths of a second."""

BLOCK_RAYS = 8192
"""Rays processed at once: their arrays stay in the second-level cache, and the overhead of calls is small."""

TILE_SIDE = 128
"""Side of a tile, pixels, unless requested otherwise."""


class Picture(Protocol):
    """Anything with a size in pixels."""

    @property
    def width(self) -> int:
        """Columns."""
        ...

    @property
    def height(self) -> int:
        """Rows."""
        ...


def passes(width: int, height: int, samples: int) -> tuple[Pass, ...]:
    """A coarse preview of the whole picture, then passes whose total of camera samples grows fourfold."""
    stride = 4
    while width * height > PREVIEW_PIXELS * stride * stride:
        stride *= 2
    rounds = [Pass(index=0, stride=stride, first=0, last=1)]
    last = 0
    while last < samples:
        first, last = last, min(max(1, 4 * last), samples)
        rounds.append(Pass(index=len(rounds), stride=1, first=first, last=last))
    return tuple(rounds)


def tiles(picture: Picture, pass_: Pass, tile_size: int | None = None) -> list[Tile]:
    """The tiles of a pass, row by row; the preview has one, the whole picture.

    Parameters
    ----------
    picture
        A plan, or anything with width and height.
    pass_ : Pass
    tile_size : int, optional
        Side of the square tiles in pixels; those at the right and lower edges are smaller. No pixel
        depends on it.
    """
    if pass_.stride > 1:
        return [Tile(index=0, x0=0, y0=0, x1=picture.width, y1=picture.height)]
    size = tile_size or TILE_SIDE
    corners = [(x, y) for y in range(0, picture.height, size) for x in range(0, picture.width, size)]
    return [
        Tile(index=i, x0=x, y0=y, x1=min(x + size, picture.width), y1=min(y + size, picture.height))
        for i, (x, y) in enumerate(corners)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Pixels processed at once.

    Attributes
    ----------
    columns, rows : (N,) int64
        Pixels of the picture, neighbours close to each other.
    bounds : tuple of int
        x0, y0, x1, y1 around them, pixels.
    """

    columns: Integers
    rows: Integers
    bounds: tuple[int, int, int, int]


def blocks(tile: Tile, pass_: Pass) -> Iterator[Block]:
    """Cut a tile into blocks of about `BLOCK_RAYS` rays."""
    side = block_side(pass_)
    step = side * pass_.stride
    for y in range(tile.y0, tile.y1, step):
        for x in range(tile.x0, tile.x1, step):
            right, bottom = min(x + step, tile.x1), min(y + step, tile.y1)
            i, j = _z_order(side)
            columns, rows = x + i * pass_.stride, y + j * pass_.stride
            inside = (columns < right) & (rows < bottom)
            yield Block(columns[inside], rows[inside], (x, y, right, bottom))


def block_side(pass_: Pass) -> int:
    """Side of a block in rows or columns of a pass: a power of two, at least 4."""
    side, pixels = 4, BLOCK_RAYS // (pass_.last - pass_.first)
    while 4 * side * side <= pixels:
        side *= 2
    return side


@cache
def _z_order(side: int) -> tuple[Integers, Integers]:
    """Columns and rows of a square in Morton's order, so that any stretch of it is compact."""
    rows, columns = np.indices((side, side), dtype=np.int64).reshape(2, -1)
    order = np.argsort(morton.codes(columns, rows))
    return columns[order], rows[order]
