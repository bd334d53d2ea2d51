"""Where there is a time limit, tiles end at it in the middle of their work, and the picture is whole."""

import time
from collections.abc import Iterator

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import camera
from renderer.adaptive import Samples, render_samples
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.driver import Driver
from renderer.adaptive.levels import SAMPLED
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.time_limits import (
    BATCH,
    CLOCK_SECONDS,
    FEWEST,
    MOST_RESERVED,
    OutOfTimeError,
    TimeLimit,
    portions,
    reserve,
)
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures

FAR = 1e12


def sizes(rays: np.ndarray, limit: TimeLimit | None) -> list[int]:
    """Rays of each portion; the slices are in order and hold each pixel once."""
    found = list(portions(rays, limit))
    assert [part.start for part in found] == [0, *(part.stop for part in found[:-1])]
    assert found[-1].stop == rays.size
    return [int(rays[part].sum()) for part in found]


@pytest.mark.parametrize("limit", [None, TimeLimit(FAR, 1e-9), TimeLimit(FAR, 1e-4)])
def test_portions_hold_every_pixel_once(limit: TimeLimit | None) -> None:
    rays = np.random.default_rng(1).integers(1, 4000, 300)
    assert sum(sizes(rays, limit)) == rays.sum()
    assert max(sizes(rays, limit)) <= BATCH


def test_expensive_rays_come_in_small_portions_so_that_the_clock_is_read() -> None:
    ones = np.ones(100_000, np.int64)
    assert sizes(ones, None)[0] == BATCH
    assert sizes(ones, TimeLimit(FAR, 1e-4))[0] == round(CLOCK_SECONDS / 1e-4)
    assert sizes(ones, TimeLimit(FAR, 10.0))[0] == FEWEST


def test_the_next_portion_is_as_large_as_the_one_before_was_slow() -> None:
    parts = portions(np.ones(100_000, np.int64), TimeLimit(FAR, 1e-4))
    next(parts)
    time.sleep(0.2)
    slow = next(parts)
    # 1,000 rays took 0.2 s or, on a busy machine, more.
    assert slow.stop - slow.start <= 500


def test_pixels_with_more_rays_than_a_portion_come_one_by_one() -> None:
    assert sizes(np.full(3, 2 * BATCH), TimeLimit(FAR, 1e-3)) == [2 * BATCH] * 3


def test_no_pixels_make_no_portions() -> None:
    assert list(portions(np.zeros(0, np.int64), TimeLimit(0.0, 1e-6))) == []


def test_a_tile_ends_at_its_limit_in_the_middle_of_its_work() -> None:
    document = pictures.of_room(camera=camera(width=96, height=96))
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=1 / 255))
    many = LevelRequest.first(np.full((96, 96), SAMPLED + 9, np.uint8))
    begun = time.process_time()
    with pytest.raises(OutOfTimeError):
        # Minutes of work.
        render_samples(
            plan, TileRequest(Tile(0, 0, 0, 96, 96), many, limit=TimeLimit(time.monotonic() + 0.3, 1e-4))
        )
    assert time.process_time() - begun < 30


def test_a_limit_that_is_not_reached_changes_no_byte() -> None:
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=1 / 255))
    tile = Tile(0, 3, 5, 30, 21)
    levels = LevelRequest.first(np.full((16, 27), SAMPLED + 2, np.uint8))
    free = render_samples(plan, TileRequest(tile, levels))
    # So small portions, and so many.
    limited = render_samples(plan, TileRequest(tile, levels, limit=TimeLimit(FAR, 1.0)))
    assert free.halves.tobytes() == limited.halves.tobytes()
    assert free.squares.tobytes() == limited.squares.tobytes()
    assert free.counts == limited.counts


def test_what_is_kept_for_the_end_is_what_it_takes_and_leaves_most_of_the_time() -> None:
    assert reserve(np.inf, 3.0) == 0
    assert reserve(100.0, 0.8) == 0.8
    assert reserve(1e-3, 40.0) == MOST_RESERVED * 1e-3


@pytest.mark.parametrize("stopped", [2, 3, 4, 5])
def test_what_a_tile_did_not_finish_is_not_merged_and_the_picture_stays_whole(stopped: int) -> None:
    """Every second tile of a pass ends too early, as at a deadline; with 2 these are borders, then probes."""
    document = pictures.of_room(camera=camera(width=64, height=48))
    hasty = TargetQuality(mode="target", error=0.5 / 255, time_limit=86400)
    plan = renderer.compile_scene(document, hasty)
    now = time.monotonic()
    render = AdaptiveRender(Driver.begin(plan, tile_size=16), None, now + 86400, now)

    def each(requests: list[TileRequest]) -> Iterator[tuple[TileRequest, Samples | None]]:
        for number, request in enumerate(requests):
            late = len(render.passes) == stopped - 1 and number % 2
            yield request, None if late else attempt(plan, request)

    while render.step(each):
        pass
    assert len(render.passes) == stopped
    error, image = render.estimate.error, render.estimate.image()
    assert error is not None
    assert 0 <= error.low <= error.estimate <= error.high <= 1
    assert render.passes[-1]["error"] == error.document()
    assert image.min() > 0
