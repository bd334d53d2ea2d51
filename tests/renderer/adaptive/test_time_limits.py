"""Time limits: tiles stop in the middle of their work, and the picture is complete."""

import time
from collections.abc import Iterator

import numpy as np
import pytest

import renderer
from renderer.adaptive import Samples
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.driver import Driver
from renderer.adaptive.requests import TileRequest
from renderer.passes import run_pass
from schemas.quality import TargetQuality
from tests.documents import camera
from tests.pictures import pictures


@pytest.mark.parametrize("lens_radius", [0.0, 0.3])
@pytest.mark.parametrize("limit", [1e-9, 0.3])
def test_picture_out_of_time_is_whole(limit: float, lens_radius: float) -> None:
    """The target would take minutes: 256 x 256 pixels with the most samples."""
    document = pictures.of_room(camera=camera(width=256, height=256, lens_radius=lens_radius))
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=1e-6, time_limit=limit))
    begun = time.process_time()
    result = renderer.render(plan)
    assert time.process_time() - begun < 10
    assert (result.image > 0).any(axis=2).mean() > 0.99
    error = result.report["error"]
    assert 0 <= error["low"] <= error["estimate"] <= error["high"]
    assert error["high"] > 1e-6


@pytest.mark.parametrize("stopped", [2, 3, 4, 5])
def test_unfinished_tile_is_not_merged(stopped: int) -> None:
    """Every second tile of a pass ends too early, as at a deadline; with 2 these are borders, then probes."""
    document = pictures.of_room(camera=camera(width=48, height=36))
    hasty = TargetQuality(mode="target", error=0.5 / 255, time_limit=86400)
    plan = renderer.compile_scene(document, hasty)
    render = AdaptiveRender(Driver.begin(plan, tile_size=16), deadline=time.monotonic() + 86400)

    def each(requests: list[TileRequest]) -> Iterator[tuple[TileRequest, Samples | None]]:
        for number, request in enumerate(requests):
            late = len(render.tally.passes) == stopped - 1 and number % 2
            yield request, None if late else attempt(plan, request)

    while run_pass(render, each):
        pass
    assert len(render.tally.passes) == stopped
    error, image = render.estimate.error, render.estimate.image()
    assert error is not None
    assert 0 <= error.low <= error.estimate <= error.high <= 1
    assert render.tally.passes[-1]["error"] == error.document()
    assert np.isfinite(image).all()
    assert image.min() > 0
