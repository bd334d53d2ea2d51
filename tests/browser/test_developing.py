"""Pictures are developed the same with a graphics card and without one."""

import base64
from pathlib import Path

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Page, Route

from renderer.images import files as image_files
from schemas.scene import Display
from tests.browser.conftest import Open
from tests.browser.pictures import COVERED, codes_of, finished, served
from tests.browser.test_picture import awkward_numbers
from tests.service.support import image

SIDE = 160
# On a renderer without a card, so that the shader runs on every machine.
DEVELOPED = """async ([text, side, exposure, transfer, channel]) => {
    const { Film } = await import("/web/views/picture/film.js");
    const { Gpu } = await import("/web/views/picture/gpu.js");
    const { Encoder } = await import("/web/views/picture/transfer.js");
    const { develop } = await import("/web/views/picture/darkroom.js");
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const film = new Film(side, side);
    film.bits.set(new Uint32Array(bytes.buffer));
    const look = { encoder: new Encoder(exposure, transfer), channel };
    const gpu = Gpu.of(film);
    if (!gpu) throw new Error("This browser has no WebGL2.");
    // A tile that comes later, beside one that stays unknown.
    const tile = { x0: 0, y0: 96, x1: 64, y1: 128, stride: 1, columns: 64, rows: 32 };
    gpu.upload(film.take({ ...tile, pixels: Float32Array.from({ length: 6144 }, (_, i) => i / 5000) }));
    const context = new OffscreenCanvas(side, side).getContext("2d", { willReadFrequently: true });
    context.drawImage(gpu.develop(look), 0, 0);
    const drawn = new Uint32Array(context.getImageData(0, 0, side, side).data.buffer);
    gpu.close();
    const expected = new Uint32Array(side * side);
    develop(film, look, film.whole, expected);
    const kinds = new Set(expected);
    return { differ: drawn.reduce((sum, word, i) => sum + (word !== expected[i]), 0), kinds: kinds.size };
}"""
WEB = Path(__file__).parents[2] / "service" / "web"
READS_BACK = """() => {
    const context = document.querySelector("canvas.pixels").getContext("2d");
    return context.getContextAttributes().willReadFrequently;
}"""


def numbers() -> str:
    """A square of awkward numbers, whose last rows are not known yet."""
    words = np.full(3 * SIDE * SIDE, 0xFFFFFFFF, np.uint32)
    values = awkward_numbers()[: 3 * SIDE * 90]
    words[: values.size] = values.view(np.uint32)
    return base64.b64encode(words.tobytes()).decode()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("exposure", "transfer", "channel"),
    [
        (0.7, "srgb", "rgb"),
        (-3, "gamma 2.2", "green"),
        (-9.5, "srgb", "luminance"),
    ],
)
def test_graphics_card_equals_loops(bare_page: Page, exposure: float, transfer: str, channel: str) -> None:
    found = bare_page.evaluate(DEVELOPED, [numbers(), SIDE, exposure, transfer, channel])
    assert found["differ"] == 0
    assert found["kinds"] > 50


@pytest.mark.slow
def test_software_renderer_is_not_used(bare_page: Page) -> None:
    asks = """async () => (await import("/web/views/picture/gpu.js")).hasGpuFor(4e6)"""
    assert bare_page.evaluate(asks) is False


@pytest.mark.slow
def test_picture_of_a_card_equals_the_service(open_page: Open, client: httpx2.Client) -> None:
    job = finished(client)
    page = open_page("/jobs")
    page.route("**/views/picture/gpu.js", with_card)
    page.goto(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    assert page.evaluate(READS_BACK) is False
    np.testing.assert_array_equal(codes_of(page), served(client, job))
    page.get_by_label("Exposure", exact=True).fill("1")
    np.testing.assert_array_equal(
        codes_of(page), image_files.displayed(image(client, job), Display(exposure=1))
    )


def with_card(route: Route) -> None:
    """Take any renderer for a card, and any picture for a large one: here is none."""
    script = (WEB / "views" / "picture" / "gpu.js").read_text()
    changes = {"WORTHWHILE = 512 * 512": "WORTHWHILE = 0", "return !SOFTWARE.test(name)": "return true"}
    for old, new in changes.items():
        assert script.count(old) == 1
        script = script.replace(old, new)
    route.fulfill(body=script, content_type="text/javascript")
