"""What drives a picture of target quality from pass to pass, independent of what runs its requests."""

from collections.abc import Iterable, Iterator

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import Json, camera, scene
from renderer.adaptive import Estimate
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.driver import Driver
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.samples import Samples
from renderer.adaptive.tile_rendering import render_request
from schemas.quality import TargetQuality
from tests.pictures import pictures

TARGET = TargetQuality(mode="target", error=4 / 255)

EMPTY = scene(camera=camera(width=513, height=257))
ROOM = pictures.of_room(camera=camera(width=40, height=30))
LENS = pictures.of_room(camera=camera(width=40, height=30, lens_radius=0.15, focus_distance=5))


def begun(document: Json) -> Driver:
    return Driver.begin(renderer.compile_scene(document, TARGET), tile_size=16)


def render_pass(driver: Driver) -> bool:
    for request in driver.requests(None):
        driver.take(request.tile, render_request(driver.estimate.plan, request))
    return driver.end_pass(last=False)


def put_away(driver: Driver) -> Driver:
    """The driver that another process makes of what this one has written."""
    estimate = Estimate.restored(driver.estimate.plan, driver.estimate.arrays())
    return Driver(estimate, driver.prices, driver.workers, driver.tile_size)


def test_every_pass_requests_samples() -> None:
    """An empty scene is interpolated between its first pilot samples: finer lattices would ask for none."""
    driver, wanted = begun(EMPTY), []
    more = True
    while more:
        wanted.append(driver.estimate.rays_wanted())
        more = render_pass(driver)
    assert len(wanted) >= 3
    assert min(wanted) > 0


@pytest.mark.parametrize("document", [ROOM, LENS], ids=["room", "lens"])
def test_stored_driver_requests_the_same(document: Json) -> None:
    kept, restored = begun(document), begun(document)
    more = True
    while more:
        for one, other in zip(kept.requests(None), restored.requests(None), strict=True):
            assert (one.tile, one.records) == (other.tile, other.records)
            assert one.levels.stacked().tobytes() == other.levels.stacked().tobytes()
        more = render_pass(kept)
        assert render_pass(restored) == more
        restored = put_away(restored)
    assert np.array_equal(kept.estimate.image(), restored.estimate.image())
    assert kept.estimate.error == restored.estimate.error


def test_picture_out_of_time_has_an_error() -> None:
    driver = begun(ROOM)
    render_pass(driver)
    assert driver.estimate.error is None
    assert not driver.end_pass(last=True)
    assert driver.estimate.error is not None


def test_cpu_seconds_add_up() -> None:
    render = AdaptiveRender(begun(ROOM))
    tiles: list[float] = []

    def transport(requests: Iterable[TileRequest]) -> Iterator[tuple[TileRequest, Samples | None]]:
        for request in requests:
            samples = attempt(render.plan, request)
            assert samples is not None
            tiles.append(samples.cpu_seconds + samples.layer_seconds)
            yield request, samples

    while render.step(transport):
        pass
    assert render.between_cpu > 0
    assert render.cpu_seconds == pytest.approx(sum(tiles) + render.between_cpu, rel=1e-12)
    assert render.passes[-1]["cpu_seconds"] == render.cpu_seconds


def test_stored_arrays_are_read_by_name() -> None:
    driver = begun(ROOM)
    while driver.estimate.error is None:
        render_pass(driver)
    plan, arrays = driver.estimate.plan, driver.estimate.arrays()
    again = Estimate.restored(plan, dict(reversed(arrays.items()))).arrays()
    assert {name: array.tobytes() for name, array in again.items()} == {
        name: array.tobytes() for name, array in arrays.items()
    }
    numbers = arrays["error"]
    turned = np.dtype([(name, np.float64) for name in reversed(numbers.dtype.names)])
    missing = {name: array for name, array in arrays.items() if name != "doubts"}
    surprising = arrays | {"surprises": arrays["doubts"]}
    reordered = arrays | {"error": np.array(numbers.item(), dtype=turned)}
    for other in (missing, surprising, reordered, arrays | {"error": np.array(numbers.item())}):
        with pytest.raises(ValueError, match=r"doubts|surprises|error"):
            Estimate.restored(plan, other)
