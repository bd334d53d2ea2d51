"""Progress of a picture of target quality: it grows, ends below 1, and is about right."""

import numpy as np
import pytest

import renderer
from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import State
from renderer.adaptive.target_plan import target_plan
from renderer.adaptive.tile_rendering import render_request
from schemas.quality import TargetQuality
from tests.documents import Json, camera
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
    left = [event.remaining_seconds for event in seen]
    unknown = sum(each is None for each in left)
    assert 0 < unknown < len(left)
    assert None not in left[unknown:]


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


def test_merging_of_each_pass_to_come_is_counted() -> None:
    """A first pass is followed by probes or samples in any case."""
    driver = Driver.begin(renderer.compile_scene(ROOM, TargetQuality(mode="target", error=1 / 255)))
    cheap, dear = driver.forecast(merging=1.0), driver.forecast(merging=3.0)
    assert dear.next == cheap.next
    assert dear.later - cheap.later >= 2 * (3.0 - 1.0)


def forecasts(document: Json, error: float) -> list[tuple[float, float]]:
    """Predicted over true work to come at each pass from the probes on, and the pass's share of all work."""
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=error))
    driver, work, expected, more = Driver.begin(plan), list[float](), list[float](), True
    while more:
        # Equal prices count work, and low ones make each pass one tile.
        driver.prices = dict.fromkeys(driver.prices, 1e-9)
        expected.append(
            driver.forecast().left(0.0) / 1e-9 if driver.estimate.state is not State.LATTICE else 0.0
        )
        work.append(driver.estimate.work_wanted())
        for request in driver.requests():
            driver.take(request.tile, render_request(target_plan(plan), request))
        more = driver.end_pass(last=False)
    left = np.cumsum(work[::-1])[::-1]
    found = zip(expected / left, work / left[0], strict=True)
    return [(ratio, share) for ratio, share in found if ratio > 0]


@pytest.mark.slow
@pytest.mark.parametrize("lens", [False, True])
def test_work_to_come_is_right_within_a_factor_of_two(lens: bool) -> None:
    """In 80 % of the time from the probes on, of pictures of all effects."""
    found = list[tuple[float, float]]()
    for name, make in SCENES.items():
        if ("lens" in name) is not lens:
            continue
        document = make()
        document["camera"] |= {"width": 96, "height": 72}
        for error in (1 / 255, 0.25 / 255):
            found += forecasts(document, error)
    ratios, shares = np.array(found).T
    right = (ratios > 0.5) & (ratios < 2.0)
    assert shares[right].sum() >= 0.8 * shares.sum()
