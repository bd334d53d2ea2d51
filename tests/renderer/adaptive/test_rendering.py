"""Whole pictures of target quality: the same bytes however they are shared out, and the requested error."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, lamp, phong, rectangle, scene, sphere
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.levels import COUNTS, COVERAGES
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.tile_rendering import render_samples
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures

TARGET = TargetQuality(mode="target", error=4 / 255)
LAYERS = ("samples", "error", "depth")


def furnished(**changes: Any) -> Json:
    """The room with a ball, small."""
    return pictures.of_room(**{"camera": camera(width=40, height=30), **changes})


def on_a_board(**material: Any) -> Json:
    """A ball over a checker board, before a lamp."""
    board = {"type": "checker", "even": [0.9, 0.8, 0.7], "odd": [0.1, 0.2, 0.3], "repeat": [9, 9]}
    return scene(
        rectangle([-3, 0, -4], [0, 0, 8], [6, 0, 0]),
        sphere([0.2, 1.1, 0], 1.0, material="other"),
        camera=camera(width=40, height=30),
        lights=[lamp([-1.5, 4, 1], [1, 0, 0], [0, 0, 1])],
        textures={"board": board},
        materials={"plain": phong(color_texture="board"), "other": phong(**material)},
    )


def rendered(document: Json, quality: TargetQuality = TARGET, **options: Any) -> renderer.RenderResult:
    return renderer.render(renderer.compile_scene(document, quality, layers=LAYERS), **options)


def same(a: renderer.RenderResult, b: renderer.RenderResult) -> None:
    """Bytes of the picture and all layers, and all that is counted."""
    assert a.image.tobytes() == b.image.tobytes()
    for name, layer in a.layers.items():
        assert layer.tobytes() == b.layers[name].tobytes(), name
    for part in ("rays", "work", "samples", "error", "numerics"):
        assert a.report[part] == b.report[part], part


@pytest.mark.parametrize("size", [16, 37, 256])
def test_no_byte_depends_on_the_size_of_tiles(size: int) -> None:
    same(rendered(furnished()), rendered(furnished(), tile_size=size))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_no_byte_depends_on_the_number_of_workers(workers: int) -> None:
    same(rendered(furnished()), rendered(furnished(), workers=workers, tile_size=16))


def test_the_report_says_what_was_done_and_how_near_the_picture_is() -> None:
    result = rendered(furnished())
    fixed = renderer.render(renderer.compile_scene(furnished()))
    report = result.report
    assert report.keys() >= fixed.report.keys()
    assert (report["width"], report["height"]) == (40, 30)
    assert 0 <= report["error"]["low"] <= report["error"]["estimate"] <= report["error"]["high"]
    assert report["error"]["estimate"] <= TARGET.error
    assert report["passes"][-1]["error"] == report["error"]
    assert report["numerics"]["non_finite"] == 0
    for name, count in report["passes"][-1]["rays"].items():
        assert count <= report["rays"][name]
    camera_rays = [entry["rays"]["camera"] for entry in report["passes"]]
    assert camera_rays == sorted(camera_rays)
    assert report["rays"]["camera"] == camera_rays[-1]


def test_layers_say_how_many_samples_a_pixel_got_and_how_far_off_it_may_be() -> None:
    result = rendered(furnished())
    samples, error = result.layers["samples"], result.layers["error"]
    assert (samples.dtype, samples.shape) == (np.int32, (30, 40))
    covers, counts = ({0, *numbers.tolist()} for numbers in (COVERAGES, COUNTS))
    assert set(np.unique(samples).tolist()) <= {1, *(a + b for a in covers for b in counts)}
    assert samples.mean() == pytest.approx(result.report["samples"]["antialiasing_mean"], rel=1e-12)
    # A pixel that went on has lost its pilot sample, one ray that is no longer counted, and perhaps smaller
    # coverages. Every coverage may have shaded as many points as it has rays.
    coverages = np.cumsum(COVERAGES)[np.searchsorted(COVERAGES, samples, side="right") - 1]
    lost = np.where(samples > 1, 1 + 2 * coverages, 0).sum()
    assert 0 <= result.report["rays"]["camera"] - samples.sum() <= lost
    assert (error.dtype, error.shape) == (np.float32, (30, 40, 3))
    assert np.isfinite(error).all()
    assert (error >= 0).all()
    assert np.isinf(result.layers["depth"]).any() or (result.layers["depth"] > 0).all()


def test_when_the_time_is_spent_at_once_the_coarse_picture_is_there_in_whole() -> None:
    """Every pixel lies between the pilot samples around it, 4 pixels apart: no tile of finer ones begins."""
    hasty = TargetQuality(mode="target", error=4 / 255, time_limit=1e-9)
    document = furnished(camera=camera(width=512, height=256))
    seen: list[renderer.TileEvent] = []
    result = rendered(document, hasty, tile_size=64, on_tile=seen.append)
    plan = renderer.compile_scene(document, TARGET)
    estimate = Estimate.begin(plan)
    whole = Tile(0, 0, 0, 512, 256)
    estimate.take(whole, render_samples(plan, TileRequest(whole, estimate.requested)))
    nodes = estimate.values[:, ::4, ::4].transpose(1, 2, 0)
    assert (result.image[::4, ::4] == nodes).all()
    corners = np.pad(nodes, ((0, 1), (0, 1), (0, 0)), mode="edge")
    around = np.stack((corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:], corners[1:, 1:]))
    around = around.repeat(4, axis=1).repeat(4, axis=2)
    coarse = ((result.image >= around.min(axis=0)) & (result.image <= around.max(axis=0))).all(axis=2)
    assert coarse.all()
    first = [event.tile for event in seen]
    assert {event.pass_.index for event in seen} == {0}
    assert sum(tile.width * tile.height for tile in first) == 256 * 512
    assert result.report["error"]["estimate"] > 0
    assert [event.done for event in seen] == list(range(1, len(seen) + 1))


@pytest.mark.parametrize("limit", [1e-9, 0.02, 1000.0])
def test_the_error_is_always_reported(limit: float) -> None:
    quality = TargetQuality(mode="target", error=4 / 255, time_limit=limit)
    report = rendered(furnished(camera=camera()), quality).report
    assert 0 <= report["error"]["low"] <= report["error"]["estimate"] <= report["error"]["high"] <= 1


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (17, 1), (2, 2), (8, 8), (9, 17)])
def test_pictures_may_have_any_size(size: tuple[int, int]) -> None:
    view = camera(width=size[1], height=size[0])
    result = rendered(furnished(camera=view))
    assert result.image.shape == (*size, 3)
    assert (result.image > 0).all()


def test_a_large_picture_takes_fewer_rays_than_sixteen_in_each_pixel_would() -> None:
    """Few of its pixels show an edge: probes that are in doubt must not ask without end."""
    report = rendered(furnished(camera=camera(width=320, height=240))).report
    assert report["error"]["estimate"] <= TARGET.error
    assert report["rays"]["camera"] < 16 * 320 * 240


def test_a_scene_with_nothing_in_it_is_known_exactly_after_pilot_samples() -> None:
    """But for the rounding of what is kept of pilot samples, and of samples, to float32."""
    result = rendered(scene(camera=camera(width=40, height=30)))
    assert (result.image == np.float32([0.05, 0.1, 0.2])).all()
    assert result.report["error"]["estimate"] <= 0.2 * 2.0**-24


SCENES: dict[str, Json] = {
    "lens": furnished(camera=camera(width=40, height=30, lens_radius=0.15, focus_distance=5)),
    "room": furnished(),
    "bulb": furnished(lights=[bulb([1, 3, 1])]),
    "no light": furnished(lights=[]),
    "board": on_a_board(),
    "mirror": on_a_board(color=[0.1, 0.1, 0.1], mirror=0.8),
    "glass": on_a_board(color=[0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5),
}


def converged(document: Json) -> NDArray[np.float32]:
    """256 samples with 16 light points each, from another seed."""
    quality = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="sobol", samples=256),
        light=LightSampling(pattern="sobol", samples=16),
    )
    sampling = {**document["sampling"], "seed": 99}
    return renderer.render(renderer.compile_scene({**document, "sampling": sampling}, quality)).image


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_as_near_to_a_converged_one_as_requested(name: str) -> None:
    """The error is reported with a bound that holds in 95 of 100 cases; it was chosen below the target."""
    document = SCENES[name]
    result = rendered(document)
    difference = np.clip(result.image, 0, 1).astype(float) - np.clip(converged(document), 0, 1)
    assert np.sqrt((difference**2).mean()) <= TARGET.error
    assert result.report["error"]["estimate"] <= TARGET.error
