"""Pictures are developed the same with a graphics card and without one."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

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
DEVELOPED = """async ([text, side, exposure, transfer, channel, stripe]) => {
    const { Film } = await import("/web/views/picture/film.js");
    const { Gpu } = await import("/web/views/picture/gpu.js");
    const { Encoder } = await import("/web/views/picture/transfer.js");
    const { develop } = await import("/web/views/picture/software.js");
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const film = new Film(side, side);
    film.bits.set(new Uint32Array(bytes.buffer));
    const look = { encoder: new Encoder(exposure, transfer), channel, stripe };
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
ENCODED = """async ([text, exposure]) => {
    const { Film } = await import("/web/views/picture/film.js");
    const { Developer } = await import("/web/views/picture/develop.js");
    const values = new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
    const film = new Film(values.length / 3, 1);
    film.fill(values);
    const context = new OffscreenCanvas(film.width, 1).getContext("2d", { willReadFrequently: true });
    const developer = new Developer({ context, redraw() {} }, film);
    developer.expose(exposure, "srgb");
    developer.change({ channel: "luminance" });
    return Array.from(context.getImageData(0, 0, film.width, 1).data);
}"""


def numbers() -> str:
    """A square of awkward numbers, whose last rows are not known yet."""
    words = np.full(3 * SIDE * SIDE, 0xFFFFFFFF, np.uint32)
    values = awkward_numbers()[: 3 * SIDE * 90]
    words[: values.size] = values.view(np.uint32)
    return base64.b64encode(words.tobytes()).decode()


@pytest.mark.parametrize(
    ("exposure", "transfer", "channel", "stripe"),
    [
        (0, "srgb", "rgb", 0),
        (0.7, "srgb", "rgb", 4),
        (-3, "gamma 2.2", "green", 0),
        (1, "linear", "luminance", 0),
        (-9.5, "srgb", "luminance", 3),
    ],
)
def test_a_graphics_card_gives_every_pixel_the_colour_that_loops_give_it(
    bare_page: Page, exposure: float, transfer: str, channel: str, stripe: int
) -> None:
    found = bare_page.evaluate(DEVELOPED, [numbers(), SIDE, exposure, transfer, channel, stripe])
    assert found["differ"] == 0
    assert found["kinds"] > 50


def test_luminance_is_shown_with_the_code_of_the_weighted_mean(bare_page: Page) -> None:
    random = np.random.default_rng(3)
    pixels = random.gamma(1, 0.4, (1, 500, 3)).astype(np.float32)
    got: Any = bare_page.evaluate(ENCODED, [base64.b64encode(pixels.tobytes()).decode(), 0.5])
    luminance = (pixels.astype(np.float64) @ [0.2126, 0.7152, 0.0722]).astype(np.float32)
    expected = image_files.displayed(luminance, Display(exposure=0.5))
    codes = np.array(got, np.uint8).reshape(1, 500, 4)
    assert (codes[..., :3] == expected[..., None]).all()


def test_a_renderer_without_a_card_is_not_used(bare_page: Page) -> None:
    asks = """async () => (await import("/web/views/picture/gpu.js")).hasGpuFor(4e6)"""
    assert bare_page.evaluate(asks) is False


def test_a_page_with_a_card_holds_the_very_picture_that_the_service_serves(
    open_page: Open, client: httpx2.Client
) -> None:
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
