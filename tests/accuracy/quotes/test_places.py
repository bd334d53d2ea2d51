"""Places that a pilot renders."""

from __future__ import annotations

import numpy as np
import pytest

from accuracy.quotes.places import APART, cells, scattered, spread
from schemas.tiles import Tile


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (8, 8), (5, 3), (1, 7), (16, 2)])
def test_every_cell_comes_once(columns: int, rows: int) -> None:
    everywhere = {(x, y) for x in range(columns) for y in range(rows)}
    order = spread(columns, rows, seed=3)
    assert len(order) == len(everywhere)
    assert set(order) == everywhere


@pytest.mark.parametrize("level", [1, 2, 3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_beginning_is_spread_evenly(level: int, seed: int) -> None:
    coarse = 1 << level
    first = spread(16, 16, seed)[: coarse * coarse]
    offsets = {(x % (16 // coarse), y % (16 // coarse)) for x, y in first}
    # One cell in each of the coarse squares, all at the same place in theirs.
    assert len(offsets) == 1
    assert len(first) == len(set(first))


def test_the_first_two_cells_are_apart_either_way() -> None:
    (x, y), (other_x, other_y) = spread(16, 16, seed=5)[:2]
    assert (abs(x - other_x), abs(y - other_y)) == (8, 8)


@pytest.mark.parametrize(("width", "height"), [(100, 70), (64, 64), (3, 130)])
def test_cells_cover_each_pixel_once(width: int, height: int) -> None:
    hits = np.zeros((height, width), dtype=int)
    for cell in cells(width, height, 32, seed=1):
        hits[cell.y0 : cell.y1, cell.x0 : cell.x1] += 1
    assert (hits == 1).all()


@pytest.mark.parametrize("tile", [Tile(0, 64, 32, 128, 96), Tile(3, 0, 0, 9, 6), Tile(1, 5, 5, 6, 6)])
def test_one_pixel_is_taken_of_each_square(tile: Tile) -> None:
    block = scattered(tile, seed=2)
    places = zip(block.columns.tolist(), block.rows.tolist(), strict=True)
    squares = {((x - tile.x0) // APART, (y - tile.y0) // APART) for x, y in places}
    assert len(squares) == block.columns.size == -(-tile.width // APART) * -(-tile.height // APART)
    assert block.bounds == (tile.x0, tile.y0, tile.x1, tile.y1)
    assert tile.x0 <= block.columns.min() <= block.columns.max() < tile.x1
    assert tile.y0 <= block.rows.min() <= block.rows.max() < tile.y1


def test_pixels_depend_on_the_seed_and_the_cell_alone() -> None:
    tile = Tile(4, 0, 0, 64, 64)
    first, again, other = (scattered(tile, seed).columns.tolist() for seed in (1, 1, 2))
    assert first == again != other
