"""Helpers for tests of pictures on the page: finished jobs, and the content of canvases."""

import base64
import io
from collections.abc import Collection
from typing import Any

import httpx2
import numpy as np
from PIL import Image
from playwright.sync_api import Page

from tests.browser.conftest import Open
from tests.service.support import finish, scene, submit

Rectangle = tuple[int, int, int, int]

CODES = """() => {
    const canvas = document.querySelector("canvas.pixels");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let text = "";
    for (const code of data) text += String.fromCharCode(code);
    return [canvas.width, canvas.height, btoa(text)];
}"""
# What is drawn over the picture: a context to read, and where a point of the picture is on it.
OVERLAY = """
    const over = document.querySelector("canvas.over");
    const copy = new OffscreenCanvas(over.width, over.height);
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(over, 0, 0);
    const pixels = document.querySelector("canvas.pixels");
    const [area, picture] = [over, pixels].map((one) => one.getBoundingClientRect());
    const scale = picture.width / pixels.width;
    const place = (x, y) => [picture.x - area.x + x * scale, picture.y - area.y + y * scale].map(Math.round);
"""
OUTLINED = (
    f"(rectangles) => {{{OVERLAY}"
    """
    // Lines lie within their tile, about two dots from its edge.
    const orange = ([x, y]) => {
        const { data } = context.getImageData(x - 1, y - 1, 3, 3);
        return data.some((red, i) => i % 4 === 0 && red > 100 && data[i + 2] < red / 2);
    };
    return rectangles.filter(([x0, y0, x1, y1]) => {
        const [left, top] = place(x0, y0);
        const [right, bottom] = place(x1, y1);
        // On an arm of each corner: they are 16 dots long, or a third of a side.
        const arm = Math.min(8, Math.min(right - left, bottom - top) / 6);
        return [
            [left + arm, top + 2], [right - 2, top + arm],
            [right - arm, bottom - 2], [left + 2, bottom - arm],
        ].every(orange);
    });
}"""
)
COVERED = """() => {
    const canvas = document.querySelector("canvas.pixels");
    if (!canvas) return false;
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.every((code, i) => i % 4 < 3 || code === 255);
}"""


def codes_of(page: Page) -> np.ndarray:
    """The codes on the canvas, (H, W, 3), all of which must be opaque."""
    width, height, encoded = page.evaluate(CODES)
    codes = np.frombuffer(base64.b64decode(encoded), np.uint8).reshape(height, width, 4)
    assert (codes[..., 3] == 255).all()
    return codes[..., :3]


def served(client: httpx2.Client, job: str) -> np.ndarray:
    """The codes of the picture file, (H, W, 3)."""
    return np.asarray(Image.open(io.BytesIO(client.get(f"/v1/jobs/{job}/image.png").content)))


def finished(client: httpx2.Client, document: dict[str, Any] | None = None, **request: Any) -> str:
    """Have a scene rendered."""
    job = submit(client, document or scene(), **request)
    finish(client, job)
    return job


def opened(open_page: Open, job: str, **options: Any) -> Page:
    """Open the page of a job and wait until its whole picture is there."""
    page = open_page(f"/jobs/{job}", **options)
    page.wait_for_function(COVERED)
    return page


def tab(page: Page, name: str) -> None:
    """Show a tab of the drawer."""
    page.get_by_role("tab", name=name).click()


def at_work(client: httpx2.Client, job: str) -> set[Rectangle]:
    """The tiles of a running job that workers render now."""
    return {
        (tile["x0"], tile["y0"], tile["x1"], tile["y1"])
        for tile in client.get(f"/v1/jobs/{job}").json()["rendering"]
    }


def outlined(page: Page, rectangles: Collection[Rectangle]) -> set[Rectangle]:
    """The rectangles around which the page draws a frame."""
    found = page.evaluate(OUTLINED, [list(rectangle) for rectangle in rectangles])
    return {(x0, y0, x1, y1) for x0, y0, x1, y1 in found}


def point_at(page: Page, x: int, y: int, size: tuple[int, int] = (80, 48)) -> None:
    """Move the mouse to the middle of a pixel, while the whole picture is shown."""
    page.mouse.move(*_middle(page, x, y, size))


def click_at(page: Page, x: int, y: int, size: tuple[int, int] = (80, 48)) -> None:
    """Click on the middle of a pixel, while the whole picture is shown."""
    page.mouse.click(*_middle(page, x, y, size))


def _middle(page: Page, x: int, y: int, size: tuple[int, int]) -> tuple[float, float]:
    page.locator(".screen").scroll_into_view_if_needed()
    box = page.locator("canvas.pixels").bounding_box()
    assert box is not None
    return box["x"] + (x + 0.5) * box["width"] / size[0], box["y"] + (y + 0.5) * box["height"] / size[1]
