"""Passes of target quality, one after another and cut off in the middle: none is worse than the first."""

from functools import cache

import numpy as np
import pytest

import renderer
from renderer.adaptive.driver import Driver
from renderer.adaptive.error_statistics import settle
from renderer.adaptive.estimate import Estimate, State
from renderer.adaptive.tile_rendering import render_request
from renderer.film import Image
from schemas.quality import FixedQuality, Quality, TargetQuality
from tests.documents import Json
from tests.pictures import pictures

SIDE = 24
TARGET = TargetQuality(mode="target", error=0.5 / 255)
CONVERGED = FixedQuality.model_validate(
    {
        "mode": "fixed",
        "antialiasing": {"pattern": "sobol", "samples": 256},
        "light": {"pattern": "sobol", "samples": 4},
    }
)
SCENES = {"checkered": pictures.checkered, "room": pictures.of_room}


def plan_of(name: str, quality: Quality, seed: int) -> renderer.RenderPlan:
    document: Json = SCENES[name]()
    document["camera"] |= {"width": SIDE, "height": SIDE}
    document["sampling"] = document["sampling"] | {"seed": seed}
    return renderer.compile_scene(renderer.load_scene(document), quality)


@cache
def reference(name: str) -> Image:
    return np.clip(renderer.render(plan_of(name, CONVERGED, 9)).image, 0, 1)


def cut_off(estimate: Estimate) -> Image:
    """The picture if the time ended now; the estimate is unchanged."""
    arrays = {name: array.copy() for name, array in estimate.arrays().items()}
    now = Estimate.restored(estimate.plan, arrays)
    settle(now)
    return now.image()


def true_errors(name: str, seed: int) -> tuple[list[float], list[float]]:
    """True errors, if the time is over after each half of each pass; and those reported after whole ones."""
    driver = Driver.begin(plan_of(name, TARGET, seed), tile_size=8)
    shown, reported = [], []
    goes_on = True
    while goes_on:
        measured = driver.estimate.state is not State.LATTICE
        requests = driver.requests()
        for number, request in enumerate(requests):
            driver.take(request.tile, render_request(driver.estimate.plan, request))
            if measured and number + 1 in {len(requests) // 2, len(requests)}:
                away = np.clip(cut_off(driver.estimate), 0, 1) - reference(name)
                shown.append(float(np.sqrt((away**2).mean())))
        goes_on = driver.end_pass(last=False)
        if driver.estimate.error:
            away = np.clip(driver.estimate.image(), 0, 1) - reference(name)
            shown.append(float(np.sqrt((away**2).mean())))
            reported.append(driver.estimate.error.estimate)
    return shown, reported


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [("checkered", 1), ("checkered", 2), ("room", 1)])
def test_first_pass_is_worst_and_last_best(name: str, seed: int) -> None:
    shown, reported = true_errors(name, seed)
    assert len(reported) > 1
    for errors in (shown, reported):
        assert max(errors) == errors[0], errors
        assert min(errors) == errors[-1] < errors[0], errors
