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
    OutOfTimeError,
    TimeLimit,
)
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures

FAR = 1e12


def test_tile_ends_at_its_limit() -> None:
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


def test_unreached_limit_changes_no_byte() -> None:
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=1 / 255))
    tile = Tile(0, 3, 5, 30, 21)
    levels = LevelRequest.first(np.full((16, 27), SAMPLED + 2, np.uint8))
    free = render_samples(plan, TileRequest(tile, levels))
    # So small portions, and so many.
    limited = render_samples(plan, TileRequest(tile, levels, limit=TimeLimit(FAR, 1.0)))
    assert free.halves.tobytes() == limited.halves.tobytes()
    assert free.squares.tobytes() == limited.squares.tobytes()
    assert free.counts == limited.counts


@pytest.mark.parametrize("stopped", [2, 3, 4, 5])
def test_unfinished_tile_is_not_merged(stopped: int) -> None:
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
