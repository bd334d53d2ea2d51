"""Pictures are developed the same with a graphics card and without one."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from renderer.images import files as image_files
from schemas.scene import Display
from tests.browser.test_picture import awkward_numbers

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
