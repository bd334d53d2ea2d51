"""What pixels at borders take from the pilot samples around them, in whichever tile and pass."""

from collections import Counter
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from accuracy.hard_cases.documents import bulb, camera, rectangle
from renderer.adaptive.coverage import cover
from renderer.adaptive.guides import packed, surroundings, unpacked
from renderer.adaptive.levels import PREVIEWED
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.tile_rendering import render_samples
from renderer.plan.plan import RenderPlan
from schemas.tiles import Tile
from tests.pictures import pictures
from tests.renderer.adaptive.test_coverage import (
    MATT,
    THIN,
    Pilots,
    at,
    covered,
    flat,
    number_of,
    picture,
    pilot_samples,
    pixels_of,
    plan_of,
    whole,
)


def test_pilot_samples_that_are_packed_and_unpacked_keep_every_bit() -> None:
    """Labels of lights and of the background would be no numbers if they were read as float32."""
    random = np.random.default_rng(3)
    values, colors = random.random((2, 3, 9, 11)).astype(np.float32)
    labels = random.integers(-5, 2**20, (9, 11)).astype(np.int32)
    labels[0, :3] = -1, -2, 2**31 - 1
    array = packed(values, labels, colors)
    assert (array.dtype, array.shape) == (np.float32, (7, 9, 11))
    for tile in (Tile(0, 0, 0, 11, 9), Tile(0, 4, 2, 8, 9)):
        found, expected = unpacked(tile, array), surroundings(tile, values, labels, colors)
        for name in ("values", "labels", "colors"):
            assert getattr(found, name).dtype == getattr(expected, name).dtype
            assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()


def around(row: int, column: int, size: tuple[int, int], tile: Tile) -> list[int]:
    """Numbers of the pixels of a picture whose pilot samples are taken to be around a pixel of a tile."""
    labels = np.arange(np.prod(size), dtype=np.int32).reshape(size)
    values = np.stack((labels, labels + 100, labels + 200)).astype(np.float32)
    nearby = surroundings(tile, *flat(values, labels)).nearby(np.array([row]), np.array([column]))
    assert (nearby.values[:, :, 0] == nearby.labels[:, 0] + np.array([[0], [100], [200]])).all()
    return list(nearby.labels[:, 0])


def test_beyond_the_picture_are_the_pixels_at_its_rim() -> None:
    every = (3, 4), Tile(0, 0, 0, 4, 3)
    assert around(1, 1, *every) == [0, 1, 2, 4, 5, 6, 8, 9, 10]
    assert around(0, 0, *every) == [0, 0, 1, 0, 0, 1, 4, 4, 5]
    assert around(0, 3, *every) == [2, 3, 3, 2, 3, 3, 6, 7, 7]
    assert around(2, 0, *every) == [4, 4, 5, 8, 8, 9, 8, 8, 9]
    assert around(2, 3, *every) == [6, 7, 7, 10, 11, 11, 10, 11, 11]
    assert around(0, 0, (1, 1), Tile(0, 0, 0, 1, 1)) == [0] * 9


def test_around_a_tile_are_the_pixels_of_the_tiles_beside_it() -> None:
    size, every, part = (9, 11), Tile(0, 0, 0, 11, 9), Tile(0, 4, 2, 8, 9)
    for row, column in np.ndindex(7, 4):
        assert around(row, column, size, part) == around(row + 2, column + 4, size, every)


Maps = dict[str, NDArray[np.float32]]


def in_tiles(plan: RenderPlan, pilots: Pilots, side: int, had: int) -> Maps:
    """What is found of all pixels, whose coverages rise by different numbers from `had` on; of every third
    pixel it does not.
    """
    rows, columns = np.indices((plan.height, plan.width))
    cover_map = np.where((rows + columns) % 3, had + 1 + (rows + 2 * columns) % 4, had).astype(np.uint8)
    had_map, none = np.full_like(cover_map, had), np.zeros_like(cover_map)
    every = LevelRequest(none + np.uint8(PREVIEWED), none, had_map, cover_map)
    found = {
        name: np.full((count, *none.shape), np.nan, dtype=np.float32)
        for name, count in (("covers", 3), ("known", 3), ("spread", 1), ("doubts", 1))
    }
    for y, x in product(range(0, plan.height, side), range(0, plan.width, side)):
        tile = Tile(0, x, y, min(x + side, plan.width), min(y + side, plan.height))
        levels = every.part(tile)
        samples = render_samples(plan, TileRequest(tile, levels, surroundings(tile, *pilots)))
        for name, map_ in found.items():
            part = map_[:, y : tile.y1, x : tile.x1]
            part[:, levels.covered] = getattr(samples, name)
    return found


@pytest.mark.parametrize("had", [0, 4])
def test_no_byte_of_a_pixel_depends_on_its_tile(had: int) -> None:
    """Of different coverages, from nothing and in a later pass: so many rays that the whole picture takes
    several batches.
    """
    plan = plan_of(pictures.of_room(camera=camera(width=40, height=30)), 2.0**-11)
    pilots = pilot_samples(plan)
    once = in_tiles(plan, pilots, 40, had)
    assert np.isfinite(once["covers"]).sum() == 3 * 40 * 30 * 2 // 3
    for side in (7, 16):
        again = in_tiles(plan, pilots, side, had)
        assert all(again[name].tobytes() == map_.tobytes() for name, map_ in once.items())


def test_a_pixel_that_is_covered_again_shows_what_it_would_have_shown_at_once() -> None:
    """A larger lattice takes the place of a smaller one."""
    plan = plan_of(pictures.of_room(camera=camera(width=40, height=30)))
    pilots, tile = pilot_samples(plan), whole(plan)
    none = np.zeros((plan.height, plan.width), dtype=np.uint8)
    at_once, again = (
        render_samples(
            plan,
            TileRequest(tile, LevelRequest(none, none, none + np.uint8(had), none + np.uint8(6)), around),
        )
        for had, around in ((0, surroundings(tile, *pilots)), (3, surroundings(tile, *pilots)))
    )
    for name in ("covers", "known", "spread", "doubts"):
        assert getattr(at_once, name).tobytes() == getattr(again, name).tobytes()


def test_no_byte_of_a_pixel_depends_on_those_sampled_with_it() -> None:
    """Along a strip that no pilot sample has hit, so that each pixel shades a point of its own."""
    plan = plan_of(picture(rectangle(*at(THIN)), materials=MATT, lights=[bulb([2, 1, 1])]))
    pilots = pilot_samples(plan)
    together = covered(plan, pilots=pilots)
    columns, rows = pixels_of(plan)
    for i in np.flatnonzero(rows == 7):
        one = np.s_[i : i + 1]
        nearby = surroundings(whole(plan), *pilots).nearby(rows[one], columns[one])
        alone = cover(plan, number_of(13), columns[one], rows[one], nearby, Counter())
        for name in ("values", "known", "spread", "doubts"):
            assert getattr(alone, name).tobytes() == getattr(together, name)[..., one].tobytes()
