"""Pictures of target quality: the same bytes for any tiles and workers, any size, and a full report."""

from typing import Any

import numpy as np
import pytest

import renderer
from schemas.quality import TargetQuality
from tests.documents import Json, camera, scene
from tests.pictures import pictures

TARGET = TargetQuality(mode="target", error=4 / 255)
LAYERS = ("samples", "error", "depth")


def furnished(**changes: Any) -> Json:
    """The room with a ball, small."""
    return pictures.of_room(**{"camera": camera(width=40, height=30), **changes})


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
def test_bytes_are_free_of_tiles(size: int) -> None:
    same(rendered(furnished()), rendered(furnished(), tile_size=size))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_bytes_are_free_of_workers(workers: int) -> None:
    same(rendered(furnished()), rendered(furnished(), workers=workers, tile_size=16))


def test_report_of_a_target() -> None:
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


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_render_ends_when_the_upper_bound_is_below_the_target(seed: int) -> None:
    """1.645 standard errors above the estimated square; the interval reaches 1.96 of them."""
    view = camera(width=24, height=18, lens_radius=0.15, focus_distance=5)
    document = furnished(camera=view)
    document["sampling"] = document["sampling"] | {"seed": seed}
    error = rendered(document, TargetQuality(mode="target", error=0.004)).report["error"]
    deviation = (error["high"] ** 2 - error["estimate"] ** 2) / 1.9599640
    assert deviation > 0
    assert error["estimate"] ** 2 + 1.6448536 * deviation <= 0.004**2 * (1 + 1e-6)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (17, 1), (2, 2), (8, 8), (9, 17)])
def test_pictures_of_any_size(size: tuple[int, int]) -> None:
    view = camera(width=size[1], height=size[0])
    result = rendered(furnished(camera=view))
    assert result.image.shape == (*size, 3)
    assert (result.image > 0).all()


def test_large_picture_takes_few_rays() -> None:
    """Few of its pixels show an edge: probes that are in doubt must not ask without end."""
    report = rendered(furnished(camera=camera(width=320, height=240))).report
    assert report["error"]["estimate"] <= TARGET.error
    assert report["rays"]["camera"] < 16 * 320 * 240


def test_empty_scene_is_exact() -> None:
    """But for the rounding of what is kept of pilot samples, and of samples, to float32."""
    result = rendered(scene(camera=camera(width=40, height=30)))
    assert (result.image == np.float32([0.05, 0.1, 0.2])).all()
    assert result.report["error"]["estimate"] <= 0.2 * 2.0**-24
