"""Tiles share out the work of a pass evenly, and none of it is lost."""

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import camera
from renderer.adaptive import Estimate
from renderer.adaptive.partition import PER_WORKER, SHORTEST, WHOLE, partition, tile_count, tiles_of
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures


def covered(tiles: list[Tile], width: int, height: int) -> NDArray[np.int64]:
    """How many tiles each pixel is in."""
    found = np.zeros((height, width), np.int64)
    for tile in tiles:
        found[tile.y0 : tile.y1, tile.x0 : tile.x1] += 1
    return found


def work_of(kind: str, rows: int, columns: int) -> NDArray[np.float64]:
    random = np.random.default_rng(3)
    if kind == "even":
        return np.ones((rows, columns))
    if kind == "corner":
        return np.exp(-np.add.outer(np.arange(rows), np.arange(columns)) / 8.0)
    if kind == "edges":
        return (random.random((rows, columns)) < 0.03).astype(float)
    return random.random((rows, columns)) ** 8


@pytest.mark.parametrize("kind", ["even", "corner", "edges", "random"])
@pytest.mark.parametrize(
    ("width", "height"), [(1600, 1600), (1024, 768), (4096, 1), (1, 97), (1, 1), (640, 33)]
)
@pytest.mark.parametrize("count", [1, 4, 7, 8, 64])
def test_every_cell_with_work_is_in_one_tile(kind: str, width: int, height: int, count: int) -> None:
    side = 16
    work = work_of(kind, -(-height // side), -(-width // side))
    tiles = partition(work, side, width, height, count)
    found = covered(tiles, width, height)
    wanted = work.repeat(side, axis=0).repeat(side, axis=1)[:height, :width] > 0
    assert found.max(initial=0) <= 1
    assert (found[wanted] == 1).all()
    assert len(tiles) <= count
    assert [tile.index for tile in tiles] == list(range(len(tiles)))


@pytest.mark.parametrize("count", [4, 7, 8, 12, 100])
def test_even_work_makes_even_tiles_and_no_slivers(count: int) -> None:
    """1448 x 1448 and slivers were the tiles of a picture of 1600 x 1600."""
    tiles = partition(np.ones((100, 100)), 16, 1600, 1600, count)
    areas = [tile.width * tile.height for tile in tiles]
    assert len(tiles) == count
    assert max(areas) <= 1.5 * min(areas)
    assert max(max(tile.width / tile.height, tile.height / tile.width) for tile in tiles) <= 3


def test_work_along_edges_is_shared_out_as_evenly_as_cells_allow() -> None:
    work = work_of("edges", 128, 128)
    tiles = partition(work, 8, 1024, 1024, 8)
    shares = [work[t.y0 // 8 : t.y1 // 8, t.x0 // 8 : t.x1 // 8].sum() / work.sum() for t in tiles]
    assert len(shares) == 8
    assert max(shares) <= 1.25 / 8


def test_all_work_in_one_cell_is_one_tile_in_the_end() -> None:
    work = np.zeros((64, 64))
    work[5, 60] = 1.0
    (tile,) = partition(work, 4, 256, 256, 16)
    assert (tile.x0 <= 240 < tile.x1, tile.y0 <= 20 < tile.y1) == (True, True)


def test_no_work_makes_no_tiles() -> None:
    assert partition(np.zeros((4, 4)), 8, 32, 32, 8) == []


@pytest.mark.parametrize("workers", [1, 2])
def test_a_pass_worth_more_than_fifty_milliseconds_has_four_tiles_a_worker(workers: int) -> None:
    assert tile_count(0.05, workers) >= PER_WORKER * workers
    assert tile_count(WHOLE, workers) == 1


@pytest.mark.parametrize("workers", [16, 1024])
@pytest.mark.parametrize("seconds", [0.06, 1.0, 30.0])
def test_many_workers_do_not_make_tiles_that_cost_more_than_they_do(workers: int, seconds: float) -> None:
    count = tile_count(seconds, workers)
    assert seconds / count >= SHORTEST
    assert count == PER_WORKER * workers or seconds / count < 2 * SHORTEST or count * 0.25 >= seconds


def test_the_first_pass_of_a_picture_with_layers_covers_every_pixel() -> None:
    document = pictures.of_room(camera=camera(width=250, height=130))
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=1 / 255))
    tiles = tiles_of(Estimate.begin(plan), 0.2, 2, layer_share=0.7)
    assert len(tiles) == 8
    assert (covered(tiles, 250, 130) == 1).all()
