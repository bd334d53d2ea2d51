"""From samples to pixels, and from tiles and blocks to pictures."""

from collections import Counter

import numpy as np
import pytest

from renderer.film import Film, compose, enlarge
from renderer.tiling import blocks, tiles
from schemas.tiles import Pass, Tile
from tests.documents import camera, scene
from tests.pictures.parts import plan_of

PREVIEW = Pass(0, 4, 0, 1)
PASSES = [Pass(1, 1, 0, 1), Pass(2, 1, 1, 4), Pass(3, 1, 4, 9)]


def pixels(value: float) -> np.ndarray:
    return np.full((2, 3, 3), value, dtype=np.float32)


def test_passes_are_weighted_by_their_samples() -> None:
    composed = compose(list(zip(PASSES, map(pixels, (9, 1, 0.5)), strict=True)))
    assert composed.dtype == np.float32
    assert (composed == np.float32((9 + 3 + 2.5) / 9)).all()


@pytest.mark.parametrize(("height", "width"), [(8, 8), (7, 5), (5, 6)])
def test_preview_is_enlarged_by_blocks(height: int, width: int) -> None:
    small = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    expected = small.repeat(4, axis=0).repeat(4, axis=1)[:height, :width]
    np.testing.assert_array_equal(enlarge(small, 4, height, width), expected)


def test_samples_reach_their_own_pixel() -> None:
    film = Film(Tile(0, 10, 20, 13, 22), Pass(1, 1, 0, 2))
    radiance = np.tile([1.0, 3.0, 5.0, 7.0], (3, 1))
    film.add(np.array([12, 10]), np.array([20, 21]), radiance)
    assert film.image()[:, :, 0].tolist() == [[0, 0, 2], [6, 0, 0]]


@pytest.mark.parametrize("size", [1, 3, 7, 64])
@pytest.mark.parametrize(("width", "height"), [(10, 7), (1, 1), (65, 3)])
def test_tiles_cover_every_pixel_once(width: int, height: int, size: int) -> None:
    plan = plan_of(scene(materials={}, camera=camera(width=width, height=height)))
    covered = np.zeros((height, width), dtype=int)
    found = tiles(plan, plan.passes[1], size)
    for tile in found:
        covered[tile.y0 : tile.y1, tile.x0 : tile.x1] += 1
    assert (covered == 1).all()
    assert [tile.index for tile in found] == list(range(len(found)))
    (whole,) = tiles(plan, plan.passes[0], size)
    assert (whole.x0, whole.y0, whole.x1, whole.y1) == (0, 0, width, height)


@pytest.mark.parametrize("pass_", [PREVIEW, *PASSES, Pass(4, 1, 0, 9999)])
@pytest.mark.parametrize("tile", [Tile(0, 0, 0, 70, 45), Tile(3, 13, 9, 14, 10), Tile(1, 8, 0, 200, 3)])
def test_blocks_cover_every_pixel_once(tile: Tile, pass_: Pass) -> None:
    seen: Counter[tuple[int, int]] = Counter()
    for block in blocks(tile, pass_):
        x0, y0, x1, y1 = block.bounds
        seen.update(zip(block.columns.tolist(), block.rows.tolist(), strict=True))
        assert ((x0 <= block.columns) & (block.columns < x1) & (y0 <= block.rows) & (block.rows < y1)).all()
    step = pass_.stride
    assert seen == {(x, y): 1 for x in range(tile.x0, tile.x1, step) for y in range(tile.y0, tile.y1, step)}
