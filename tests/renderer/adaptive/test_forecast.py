"""Progress of a picture of target quality: it grows, ends below 1, and is about right."""

import time

import numpy as np
import pytest

import renderer
from schemas.quality import TargetQuality
from tests.documents import camera
from tests.pictures import pictures
from tests.renderer.adaptive.test_target_quality import SCENES

ROOM = pictures.of_room(camera=camera(width=96, height=72))


@pytest.mark.parametrize("workers", [None, pytest.param(2, marks=pytest.mark.slow)])
def test_events_report_a_growing_share(workers: int | None) -> None:
    plan = renderer.compile_scene(ROOM, TargetQuality(mode="target", error=0.5 / 255))
    seen: list[renderer.TileEvent] = []
    renderer.render(plan, on_tile=seen.append, workers=workers)
    shares, tiles = [event.share for event in seen], [event.done / event.total for event in seen]
    assert shares == sorted(shares)
    assert tiles == sorted(tiles)
    assert 0 < shares[0] < shares[-1] < 1
    assert tiles[0] < 0.5
    assert all(event.remaining_seconds is not None and event.remaining_seconds > 0 for event in seen)


def test_time_limit_bounds_the_remaining_seconds() -> None:
    """A target that is out of reach: the limit is what ends the picture."""
    plan = renderer.compile_scene(ROOM, TargetQuality(mode="target", error=1e-6, time_limit=0.5))
    seen: list[renderer.TileEvent] = []
    renderer.render(plan, on_tile=seen.append)
    assert [event.share for event in seen] == sorted(event.share for event in seen)
    assert all(event.remaining_seconds is None or event.remaining_seconds <= 0.5 for event in seen)


def test_share_of_fixed_quality() -> None:
    seen: list[renderer.TileEvent] = []
    renderer.render(renderer.compile_scene(pictures.of_room()), on_tile=seen.append, tile_size=16)
    assert [event.share for event in seen] == [event.done / event.total for event in seen]
    assert seen[-1].share == 1
    assert seen[-1].remaining_seconds == 0


@pytest.mark.slow
def test_share_is_near_that_of_cpu_seconds() -> None:
    """Over all tiles of many pictures."""
    off: list[float] = []
    for make in SCENES.values():
        document = make()
        document["camera"] |= {"width": 96, "height": 72}
        for error in (2 / 255, 0.5 / 255):
            plan = renderer.compile_scene(document, TargetQuality(mode="target", error=error))
            begun = time.process_time()
            reports: list[tuple[float, float]] = []

            def note(event: renderer.TileEvent, reports: list[tuple[float, float]] = reports) -> None:
                reports.append((event.share, time.process_time()))

            renderer.render(plan, on_tile=note)
            whole = time.process_time() - begun
            off += [abs(share - (spent - begun) / whole) for share, spent in reports]
    assert np.median(off) <= 0.2
    assert np.quantile(off, 0.9) <= 0.5
