"""Cost of target quality, predicted from the first passes of the picture."""

import pytest

from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.rehearsals import rehearse
from accuracy.quotes.settings import target
from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import State
from renderer.adaptive.tile_rendering import render_request
from renderer.compiling import compile_scene
from renderer.rendering import render
from renderer.scenes import LoadedScene


def test_picture_that_fits_the_time_is_known(ball_scene: LoadedScene) -> None:
    plan = compile_scene(ball_scene, target(2 / 255, "single"))
    known = rehearse(plan, Deadline.after(3600.0))
    assert known.reached is not None
    error = render(plan).report["error"]
    assert known.reached.document().items() <= error.items()
    assert 0 < known.cpu_seconds.low < known.cpu_seconds.estimate < known.cpu_seconds.high


def test_guess_is_wider_the_earlier_the_time_is_over(ball_scene: LoadedScene) -> None:
    plan = compile_scene(ball_scene, target(0.5 / 255, "single"))
    known, guess = (rehearse(plan, Deadline.after(seconds)) for seconds in (3600.0, 0.0))
    assert guess.reached is None
    widths = [each.cpu_seconds.high / each.cpu_seconds.low for each in (known, guess)]
    assert widths[0] < widths[1]


def rays_of_pass(driver: Driver) -> int:
    """Render the next pass."""
    rays = driver.estimate.rays_wanted()
    for request in driver.requests():
        driver.take(request.tile, render_request(driver.estimate.plan, request))
    return rays


@pytest.mark.slow
def test_passes_predict_the_rays(ball_scene: LoadedScene) -> None:
    """The order of magnitude: what a few probes say is rough."""
    camera = ball_scene.document.camera.model_copy(update={"width": 160, "height": 160})
    scene = LoadedScene(ball_scene.document.model_copy(update={"camera": camera}), ball_scene.assets)
    plan = compile_scene(scene, target(0.25 / 255, "single"))
    driver, rays = Driver.begin(plan), 0
    while driver.estimate.state is not State.SAMPLE:
        rays += rays_of_pass(driver)
        assert driver.end_pass(last=False)
    ahead = driver.forecast()
    expected = rays + (ahead.next + ahead.later) / driver.prices["samples"]
    rays += rays_of_pass(driver)
    while driver.end_pass(last=False):
        rays += rays_of_pass(driver)
    assert 0.25 < expected / rays < 4.0
