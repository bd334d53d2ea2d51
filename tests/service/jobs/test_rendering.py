"""A scene sent over HTTP becomes the picture that the renderer makes."""

import io
from typing import Any

import httpx2
import numpy as np
from PIL import Image

import renderer
from renderer.images.files import displayed
from tests.service.support import API_ON_BOTH, finish, image, scene, submit

RANDOM = {"pattern": "random", "light_pattern": "random"}


def rendered(document: dict[str, Any], **options: Any) -> renderer.RenderResult:
    return renderer.render(renderer.compile_scene(document), workers=1, **options)


@API_ON_BOTH
def test_image_has_the_bytes_that_the_renderer_makes(api: httpx2.Client) -> None:
    document = scene(**RANDOM)
    job = submit(api, document)
    done = finish(api, job)
    assert done["progress"] == {
        "done": done["progress"]["total"],
        "total": done["last_seq"],
        "share": 1.0,
        "remaining_seconds": None,
    }
    assert image(api, job).tobytes() == rendered(document).image.tobytes()


def test_png_shows_the_image_as_its_scene_asks(api: httpx2.Client) -> None:
    document = scene() | {"display": {"transfer": "srgb", "exposure": 1}}
    job = submit(api, document)
    finish(api, job)
    png = np.asarray(Image.open(io.BytesIO(api.get(f"/v1/jobs/{job}/image.png").content)))
    shown = displayed(rendered(document).image, renderer.load_scene(document).document.display)
    assert np.array_equal(png, shown)


def test_quality_of_a_request_replaces_the_sampling_of_its_scene(api: httpx2.Client) -> None:
    light = {"pattern": "uniform", "samples": 1}
    quality = {"mode": "fixed", "antialiasing": {"pattern": "center", "samples": 1}, "light": light}
    job = submit(api, scene(samples=16), quality=quality)
    finish(api, job)
    wanted = rendered(scene(samples=1, light_samples=1, pattern="center"))
    assert image(api, job).tobytes() == wanted.image.tobytes()


def test_cost_is_that_of_rendering_in_process(api: httpx2.Client) -> None:
    document = scene(64, 64, samples=4)
    job = submit(api, document)
    cost = finish(api, job)["cost"]
    stride = api.get(f"/v1/jobs/{job}/tiles").json()["events"][0]["stride"]
    assert cost["rays"]["camera"] == 64 * 64 * 4 + (64 // stride) ** 2
    assert cost["cpu_seconds"] > 0
    report = rendered(document, on_tile=lambda _: None).report
    assert (cost["rays"], cost["work"]) == (report["rays"], report["work"])
    # What is not done is counted as zero.
    assert cost["work"]["shading_points"] > 0
    assert cost["rays"]["mirror"] == cost["work"]["texture_lookups"] == 0
