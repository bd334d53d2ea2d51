"""Photograph the live page for the documentation: a job of the gallery with an error of half a code value.

Run it with ``python -m tools.docs.make_page_picture``, on a machine with Chromium and the extra ``test``. It
writes ``docs/images/page.png``, and below ``docs/images/page`` one picture for each size of a window and each
theme.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import Literal

import httpx2
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from service.server import running
from service.settings import Settings

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "gallery" / "basic.json"
PICTURE = ROOT / "docs" / "images" / "page.png"
FOLDER = ROOT / "docs" / "images" / "page"
QUALITY = {"mode": "target", "error": 0.002}
LAYERS = ["depth", "normal", "shape", "samples", "error"]
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
# Width and height of a window, and the tab that its picture shows.
WINDOWS = {(1280, 800): "Pixel", (1920, 1080): "Render", (390, 844): "Render", (360, 740): "Plan"}
# A place in the shadow of the ball, as shares of the picture.
SHADOW = (0.46, 0.72)
# Of WebP: the eye sees no difference, and all pictures together have some hundred kB.
WEBP_QUALITY = 82
TIMEOUT_MS = 120_000


def main() -> None:
    """Start a service, render the scene, open the page of the job, and keep what it looks like."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as data, running(_settings(Path(data))) as server:
        address = server.url + submit(server.url)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox"]
            )
            for theme in THEMES:
                for size, tab in WINDOWS.items():
                    save(photograph(browser, address, size, theme, tab), size, theme)
            browser.close()


def _settings(data: Path) -> Settings:
    return Settings(data=data, port=0, log_level="error")


def submit(url: str) -> str:
    """Render the scene; the path of its page."""
    scene = json.loads(SCENE.read_text())
    request = {"scene": scene, "quality": QUALITY, "layers": LAYERS}
    answer = httpx2.post(f"{url}/v1/jobs", json=request, headers={"Prefer": "wait=60"}, timeout=90)
    return f"/jobs/{answer.raise_for_status().json()['id']}"


def photograph(
    browser: Browser, address: str, size: tuple[int, int], theme: Literal["light", "dark"], tab: str
) -> Image.Image:
    """Open the page of the job in a window, and return what it shows."""
    viewport = {"width": size[0], "height": size[1]}
    context = browser.new_context(viewport=viewport, color_scheme=theme, reduced_motion="reduce")
    page = context.new_page()
    page.set_default_timeout(TIMEOUT_MS)
    page.goto(address, wait_until="networkidle")
    page.get_by_text("finished").wait_for()
    page.get_by_role("tab", name=tab).click()
    if tab == "Pixel":
        _ask(page)
    page.wait_for_load_state("networkidle")
    shown = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    context.close()
    return shown


def _ask(page: Page) -> None:
    """Have the pixel in the shadow explained."""
    box = page.locator("canvas.pixels").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + SHADOW[0] * box["width"], box["y"] + SHADOW[1] * box["height"])
    page.get_by_role("heading", name=re.compile(r"Pixel \d")).wait_for()


def save(shown: Image.Image, size: tuple[int, int], theme: str) -> None:
    """Write what the page shows, and the picture at the head of its documentation."""
    shown.save(FOLDER / f"{size[0]}-{theme}.webp", quality=WEBP_QUALITY, method=6)
    if (size, theme) == (next(iter(WINDOWS)), THEMES[0]):
        shown.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
