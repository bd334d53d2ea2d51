"""Target quality that goes on in another process: what is stored between passes is all that it needs."""

from pathlib import Path

import numpy as np
import pytest

import renderer
from renderer.adaptive import Estimate
from renderer.adaptive.driver import Driver
from renderer.adaptive.forecast import usual_prices
from renderer.adaptive.target_plan import target_plan
from renderer.adaptive.tile_rendering import render_request
from schemas.quality import TargetQuality
from tests.documents import Json, camera
from tests.pictures import pictures
from tests.pictures.references import CONVERGED, root_of_product

TARGET = TargetQuality(mode="target", error=4 / 255)
ROOM = pictures.of_room(camera=camera(width=40, height=30))
LENS = pictures.of_room(camera=camera(width=40, height=30, lens_radius=0.15, focus_distance=5))


def begun(document: Json) -> Driver:
    return Driver.begin(renderer.compile_scene(document, TARGET), tile_size=16)


def render_pass(driver: Driver, *, last: bool = False) -> bool:
    for request in driver.requests():
        driver.take(request.tile, render_request(driver.estimate.plan, request))
    return driver.end_pass(last=last)


def restored(driver: Driver) -> Driver:
    """The driver that another process makes of what this one has stored."""
    estimate = Estimate.restored(driver.estimate.plan, driver.estimate.arrays())
    return Driver(estimate, driver.prices, driver.workers, driver.tile_size)


@pytest.mark.parametrize("document", [ROOM, LENS], ids=["room", "lens"])
def test_restored_driver_makes_the_same_picture(document: Json) -> None:
    driver = begun(document)
    while render_pass(driver):
        driver = restored(driver)
    expected = renderer.render(renderer.compile_scene(document, TARGET), tile_size=16)
    assert driver.estimate.image().tobytes() == expected.image.tobytes()
    assert driver.estimate.error is not None
    assert driver.estimate.error.document() == expected.report["error"]


def test_picture_out_of_time_has_an_error() -> None:
    driver = begun(ROOM)
    assert render_pass(driver)
    assert driver.estimate.error is None
    assert not render_pass(driver, last=True)
    assert driver.estimate.error is not None


def test_stored_arrays_are_read_by_name() -> None:
    driver = begun(ROOM)
    while driver.estimate.error is None:
        render_pass(driver)
    plan, arrays = driver.estimate.plan, driver.estimate.arrays()
    again = Estimate.restored(plan, dict(reversed(arrays.items()))).arrays()
    assert {name: array.tobytes() for name, array in again.items()} == {
        name: array.tobytes() for name, array in arrays.items()
    }
    name = next(iter(arrays))
    missing = {other: array for other, array in arrays.items() if other != name}
    surprising = arrays | {"surprise": arrays[name]}
    error = arrays["error"]
    turned = np.dtype([(field, np.float64) for field in reversed(error.dtype.names)])
    reordered = arrays | {"error": np.array(error.item(), dtype=turned)}
    for other in (missing, surprising, reordered):
        with pytest.raises(ValueError, match=r"\w"):
            Estimate.restored(plan, other)


@pytest.mark.parametrize("state", ["borders", "probes", "sample"])
def test_picture_that_version_0_1_0_has_begun_goes_on(state: str) -> None:
    """Before its passes of these states, at 0.5/255, in the form in which that version stored it."""
    document = pictures.of_room(camera=camera(width=20, height=15))
    plan = target_plan(renderer.compile_scene(document, TargetQuality(mode="target", error=0.5 / 255)))
    with np.load(Path(__file__).with_name("pictures_of_0_1_0.npz")) as stored:
        arrays = {key.partition("/")[2]: stored[key] for key in stored if key.startswith(f"{state}/")}
    driver = Driver(Estimate.restored(plan, arrays), usual_prices(plan), 0, 16)
    while render_pass(driver):
        pass
    image = driver.estimate.image()
    assert np.isfinite(image).all()
    first, second = (
        np.clip(image, 0, 1)
        - np.clip(
            renderer.render(renderer.compile_scene(document | {"sampling": {"seed": seed}}, CONVERGED)).image,
            0,
            1,
        )
        for seed in (1001, 1002)
    )
    assert root_of_product(first, second) <= 1.25 * 0.5 / 255
