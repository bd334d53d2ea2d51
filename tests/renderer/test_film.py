"""From samples to pixels."""

from fractions import Fraction

import numpy as np
import pytest

from accuracy.hard_cases.documents import scene
from renderer.film import Film, compose, enlarge
from renderer.tiling import blocks, tiles
from schemas.tiles import Pass, Tile
from tests.pictures.parts import plan_of

PREVIEW = Pass(0, 4, 0, 1)
ROUNDS = [Pass(1, 1, 0, 1), Pass(2, 1, 1, 4), Pass(3, 1, 4, 9)]


def pixels(value: float) -> np.ndarray:
    return np.full((2, 3, 3), value, dtype=np.float32)


def test_passes_weigh_by_samples() -> None:
    composed = compose([(ROUNDS[0], pixels(9)), (ROUNDS[1], pixels(1)), (ROUNDS[2], pixels(0.6))])
    assert composed.dtype == np.float32
    assert (composed == np.float32((9 + 3 + 5 * Fraction(float(np.float32(0.6)))) / 9)).all()


def test_one_pass_is_itself() -> None:
    image = np.random.default_rng(1).random((4, 5, 3)).astype(np.float32)
    assert compose([(ROUNDS[0], image)]).tobytes() == image.tobytes()


def test_preview_has_no_weight() -> None:
    assert (compose([(PREVIEW, pixels(7)[:1, :1]), (ROUNDS[0], pixels(1))]) == 1).all()


@pytest.mark.parametrize(("height", "width"), [(8, 8), (7, 5), (5, 6)])
def test_preview_is_enlarged(height: int, width: int) -> None:
    small = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    large = enlarge(small, 4, height, width)
    assert large.shape == (height, width, 3)
    for y in range(height):
        for x in range(width):
            assert (large[y, x] == small[y // 4, x // 4]).all()


def test_samples_reach_their_pixel() -> None:
    film = Film(Tile(0, 10, 20, 13, 22), Pass(1, 1, 0, 2))
    radiance = np.zeros((3, 4))
    radiance[:, :2], radiance[:, 2:] = [[1, 3]] * 3, [[5, 7]] * 3
    film.add(np.array([12, 10]), np.array([20, 21]), radiance)
    assert film.image()[:, :, 0].tolist() == [[0, 0, 2], [6, 0, 0]]


@pytest.mark.parametrize("size", [1, 3, 7, 64])
@pytest.mark.parametrize(("width", "height"), [(10, 7), (1, 1), (65, 3)])
def test_tiles_cover_every_pixel_once(width: int, height: int, size: int) -> None:
    plan = plan_of(
        {**scene(), "materials": {}, "camera": {**scene()["camera"], "width": width, "height": height}}
    )
    covered = np.zeros((height, width), dtype=int)
    found = tiles(plan, plan.passes[1], size)
    for tile in found:
        covered[tile.y0 : tile.y1, tile.x0 : tile.x1] += 1
    assert (covered == 1).all()
    assert [tile.index for tile in found] == list(range(len(found)))
    (whole,) = tiles(plan, plan.passes[0], size)
    assert (whole.x0, whole.y0, whole.x1, whole.y1) == (0, 0, width, height)


@pytest.mark.parametrize("pass_", [PREVIEW, *ROUNDS, Pass(4, 1, 0, 9999)])
@pytest.mark.parametrize("tile", [Tile(0, 0, 0, 70, 45), Tile(3, 13, 9, 14, 10), Tile(1, 8, 0, 200, 3)])
def test_blocks_cover_a_tile_once(tile: Tile, pass_: Pass) -> None:
    seen: dict[tuple[int, int], int] = {}
    for block in blocks(tile, pass_):
        x0, y0, x1, y1 = block.bounds
        for x, y in zip(block.columns.tolist(), block.rows.tolist(), strict=True):
            seen[x, y] = seen.get((x, y), 0) + 1
            assert x0 <= x < x1
            assert y0 <= y < y1
    step = pass_.stride
    expected = {(x, y) for x in range(tile.x0, tile.x1, step) for y in range(tile.y0, tile.y1, step)}
    assert set(seen) == expected
    assert set(seen.values()) == {1}
