"""How much of a picture is said to be done: never less than before, never all of it, and about right."""

from collections.abc import Iterator

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import Json, camera
from renderer.adaptive import Estimate, Samples
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.driver import Driver
from renderer.adaptive.forecast import (
    MOST,
    PASSES,
    TILE_SECONDS,
    Forecast,
    Progress,
    forecast,
    measured_prices,
    seconds_left,
    share_by,
    usual_prices,
)
from renderer.adaptive.requests import TileRequest
from schemas.quality import TargetQuality
from tests.pictures import pictures
from tests.renderer.adaptive.test_rendering import SCENES

INF = float("inf")


def test_share_of_predicted_seconds() -> None:
    known = Forecast(next=2.0, later=5.0)
    assert known.share(3.0, 0.0) == 0.3
    assert known.share(4.0, 0.5) == 0.4
    assert known.share(5.0, 1.0) == 0.5
    assert known.share(0.0, 0.0) == 0.0
    assert Forecast(next=1.0, later=0.0).share(9.0, 1.5) == MOST < 1


def test_share_with_a_time_limit() -> None:
    assert share_by(0.3, 1.0, INF) == 0.3
    assert share_by(0.3, 5.0, 10.0) == 0.5
    assert share_by(0.6, 5.0, 10.0) == 0.6
    assert share_by(0.6, 11.0, 10.0) == MOST
    assert seconds_left(0.25, 5.0, INF) == 15.0
    assert seconds_left(0.25, 5.0, 12.0) == 7.0
    assert seconds_left(0.5, 5.0, 12.0) == 5.0
    assert seconds_left(0.9, 13.0, 12.0) == 0.0
    assert seconds_left(0.0, 1.0, INF) is None


def test_share_never_falls() -> None:
    random = np.random.default_rng(11)
    progress, shares, tiles = Progress(INF), [0.0], [0.0]
    for done in range(1, 400):
        progress.note(float(random.random() ** 3), done, 1.0)
        shares.append(progress.share)
        tiles.append(done / progress.total)
    assert shares == sorted(shares)
    assert tiles == sorted(tiles)
    assert tiles[-1] < 1


def test_pass_is_predicted_from_its_rays() -> None:
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=1 / 255))
    estimate = Estimate.begin(plan)
    prices = usual_prices(plan)
    once = forecast(estimate, prices)
    twice = forecast(estimate, {kind: 2 * price for kind, price in prices.items()})
    assert once.next == pytest.approx(estimate.rays_wanted() * prices["pilots"])
    assert twice.next == pytest.approx(2 * once.next)
    assert twice.later - PASSES == pytest.approx(2 * (once.later - PASSES))


def test_cut_pass_keeps_its_price() -> None:
    """Else the next pass would be cut finer, and so on."""
    whole = measured_prices({}, "pilots", 10_000, 0.1, tiles=1)
    cut = measured_prices({}, "pilots", 10_000, 0.1 + 11 * TILE_SECONDS, tiles=12)
    assert whole == {"pilots": 1e-5}
    assert cut == pytest.approx(whole)
    assert measured_prices({}, "pilots", 10, 1e-3, tiles=100)["pilots"] > 0
    assert measured_prices({"pilots": 2.0}, "pilots", 0, 0.5, tiles=0) == {"pilots": 2.0}


Reports = list[tuple[float, float]]
"""After each tile: the reported share, and the CPU seconds spent."""


def followed(document: Json, error: float) -> Reports:
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=error))
    reports: Reports = []
    render = AdaptiveRender(
        Driver.begin(plan, workers=2), lambda event: reports.append((event.share, render.cpu_seconds))
    )

    def each(requests: list[TileRequest]) -> Iterator[tuple[TileRequest, Samples | None]]:
        return ((request, attempt(plan, request)) for request in requests)

    while render.step(each):
        pass
    return [(share, spent / render.cpu_seconds) for share, spent in reports]


@pytest.mark.slow
def test_share_is_near_that_of_cpu_seconds() -> None:
    """Over all tiles of many pictures."""
    off = []
    for document in SCENES.values():
        for error in (2 / 255, 0.5 / 255):
            view = {**document["camera"], "width": 96, "height": 72}
            reports = followed({**document, "camera": view}, error)
            shares = [share for share, _ in reports]
            assert shares == sorted(shares)
            assert shares[0] > 0
            assert shares[-1] < 1
            off += [abs(share - true) for share, true in reports]
    assert np.median(off) <= 0.2
    assert np.quantile(off, 0.9) <= 0.5


@pytest.mark.parametrize("workers", [None, 2])
def test_events_report_a_growing_share(workers: int | None) -> None:
    document = pictures.of_room(camera=camera(width=120, height=90))
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=0.5 / 255))
    seen: list[renderer.TileEvent] = []
    renderer.render(plan, on_tile=seen.append, workers=workers)
    shares, tiles = [event.share for event in seen], [event.done / event.total for event in seen]
    assert shares == sorted(shares)
    assert tiles == sorted(tiles)
    assert 0 < shares[0] < shares[-1] < 1
    assert tiles[0] < 0.5
    assert all(event.remaining_seconds is not None and event.remaining_seconds > 0 for event in seen)


def test_share_of_fixed_quality() -> None:
    seen: list[renderer.TileEvent] = []
    renderer.render(renderer.compile_scene(pictures.of_room()), on_tile=seen.append, tile_size=16)
    assert [event.share for event in seen] == [event.done / event.total for event in seen]
    assert seen[-1].share == 1
    assert seen[-1].remaining_seconds == 0
