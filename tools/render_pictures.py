"""Render the pictures of the documentation and of the page: `make gallery`.

`python tools/render_pictures.py cookbook` renders one part: gallery, cookbook, layers, or page, which
photographs the live page and needs Chromium.
"""

from __future__ import annotations

import io
import itertools
import json
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import httpx2
import numpy as np
from PIL import Image

import renderer
from renderer.images.files import displayed
from schemas.quality import TargetQuality
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[1]
SCENES = ROOT / "scenes"
IMAGES = ROOT / "docs" / "images"
WEB = ROOT / "service" / "web"
COPY_WIDTH, THUMBNAIL_WIDTH = 384, 256
"""Most columns of copies for pages, and of the pictures from which people choose a scene on the live page."""
COOKBOOK = ROOT / "docs" / "how-to" / "cookbook.md"
RECIPE = re.compile(r"(?ms)^!\[[^]]+\]\(\.\./images/cookbook/([\w-]+)\.png\)\n.*?^```json\n(.*?)^```")
TARGET_ERROR = re.compile(r"(?m)^penumbra render .* --target-error (\S+)$")
PALETTE = np.array([0x4477AA, 0xCCBB44, 0x228833, 0xEE6677, 0xAA3377, 0x66CCEE, 0xBBBBBB])
"""Colours that people with any colour vision can distinguish (Paul Tol's bright scheme)."""
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
SHADOW = (0.46, 0.72)
"""A place in the shadow of the ball, as shares of the picture."""


def pixels(scene: renderer.LoadedScene, quality: TargetQuality | None = None) -> Image.Image:
    """Render a scene on all processors; what a display shows."""
    plan = renderer.compile_scene(scene, quality)
    image = renderer.render(plan, workers=os.cpu_count()).image
    return Image.fromarray(displayed(image, scene.document.display))


def narrowed(image: Image.Image, width: int) -> Image.Image:
    """The picture at a width or less, its shape kept."""
    width = min(width, image.width)
    return image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)


def gallery() -> None:
    """The gallery and the hard scenes into out, copies for pages, and what the live page offers."""
    for folder in ("gallery", "hard"):
        (ROOT / "out" / folder).mkdir(parents=True, exist_ok=True)
        for path in sorted((SCENES / folder).glob("*.json")):
            image = pixels(renderer.load_scene(path))
            image.save(ROOT / "out" / folder / f"{path.stem}.png")
            narrowed(image, COPY_WIDTH).save(IMAGES / folder / f"{path.stem}.png", optimize=True)
    table = (SCENES / "gallery" / "README.md").read_text()
    entries = [offer(*row) for row in re.findall(r"(?m)^\| \[(\w+)\.json\]\(\S+\) \| (.+) \|$", table)]
    (WEB / "gallery.json").write_text(json.dumps(entries, indent=2) + "\n")


def offer(name: str, notice: str) -> dict[str, Any]:
    """Make the small picture of a scene, and say what to notice in it."""
    with Image.open(IMAGES / "gallery" / f"{name}.png") as image:
        small = narrowed(image.convert("RGB"), THUMBNAIL_WIDTH)
    small.save(WEB / "thumbnails" / f"{name}.webp", quality=85, method=6)
    title = name.replace("_", " ").capitalize()
    shown = notice.replace("`", "")
    return {"name": name, "title": title, "notice": shown, "width": small.width, "height": small.height}


def cookbook() -> None:
    """The pictures of the cookbook, from the scenes on its page and with the quality of its command."""
    page = COOKBOOK.read_text()
    (error,) = TARGET_ERROR.findall(page)
    for name, scene in RECIPE.findall(page):
        loaded = renderer.load_scene(scene.encode(), assets=ROOT)
        image = pixels(loaded, TargetQuality(mode="target", error=float(error)))
        image.save(IMAGES / "cookbook" / f"{name}.png", optimize=True)


def layers() -> None:
    """Depth, normal and shape of a scene side by side."""
    document = json.loads((SCENES / "gallery" / "basic.json").read_text())
    quick = {"antialiasing": {"pattern": "center"}, "light": {"samples": 1}}
    plan = renderer.compile_scene(
        document | {"sampling": quick, "lights": []}, layers=["depth", "normal", "shape"]
    )
    found = renderer.render(plan).layers
    depth, seen = found["depth"], found["shape"] >= 0
    near, far = depth[seen].min(), depth[seen].max()
    grey = np.repeat((1 - 0.9 * (depth - near) / (far - near))[..., None], 3, axis=2)
    colours = PALETTE[found["shape"] % len(PALETTE), None] >> np.array([16, 8, 0]) & 255
    parts = [
        np.where(seen[..., None], part, 0) for part in (255 * grey, 127.5 * (found["normal"] + 1), colours)
    ]
    Image.fromarray(np.hstack(parts).astype(np.uint8)).reduce(2).save(IMAGES / "layers.png", optimize=True)


def page() -> None:
    """The live page: start, a finished job, the same on a phone, and a comparison; in both themes."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - of the group `test`

    (IMAGES / "page").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as data, sync_playwright() as playwright:
        settings = Settings(data=Path(data), port=0, log_level="error")
        program = shutil.which("chromium-headless-shell") or shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        with running(settings) as server:
            fine, coarse = (submitted(server.url, error) for error in (0.002, 0.02))
            views = {
                "start": ("/", (1440, 900), quoted),
                "job": (f"/jobs/{fine}", (1280, 800), explained),
                "phone": (f"/jobs/{fine}", (360, 740), planned),
                "compare": (f"/compare/{coarse}/{fine}", (1280, 800), compared),
            }
            for (name, (path, size, prepare)), theme in itertools.product(views.items(), THEMES):
                shown = photograph(browser, server.url + path, size, theme, prepare)
                shown.save(IMAGES / "page" / f"{name}-{theme}.webp", quality=82, method=6)
                if (name, theme) == ("job", "light"):
                    shown.save(IMAGES / "page.png", optimize=True)
        browser.close()


def submitted(url: str, error: float) -> str:
    """Render a scene with a target error; the id of the job."""
    request = {
        "scene": json.loads((SCENES / "gallery" / "basic.json").read_text()),
        "quality": {"mode": "target", "error": error},
        "layers": ["depth", "normal", "shape", "samples", "error"],
    }
    answer = httpx2.post(f"{url}/v1/jobs", json=request, headers={"Prefer": "wait=60"}, timeout=90)
    return str(answer.raise_for_status().json()["id"])


def quoted(shown: Any) -> None:
    """Wait until the quote of a scene is there."""
    shown.get_by_role("region", name="Quote").get_by_text("code values").first.wait_for()


def explained(shown: Any) -> None:
    """Have a pixel in a shadow explained."""
    shown.get_by_role("tab", name="Pixel").click()
    box = shown.locator("canvas.pixels").bounding_box()
    shown.mouse.click(box["x"] + SHADOW[0] * box["width"], box["y"] + SHADOW[1] * box["height"])
    shown.get_by_role("heading", name=re.compile(r"Pixel \d")).wait_for()


def planned(shown: Any) -> None:
    """Show the plan of a job."""
    shown.get_by_role("tab", name="Plan").click()


def compared(shown: Any) -> None:
    """Wait until two pictures are compared."""
    shown.get_by_role("heading", name="Numbers").wait_for()


def photograph(
    browser: Any,
    address: str,
    size: tuple[int, int],
    theme: Literal["light", "dark"],
    prepare: Callable[[Any], None],
) -> Image.Image:
    """Open a page in a window, prepare it, and return what it shows."""
    viewport = {"width": size[0], "height": size[1]}
    context = browser.new_context(viewport=viewport, color_scheme=theme, reduced_motion="reduce")
    shown = context.new_page()
    shown.set_default_timeout(120_000)
    shown.goto(address, wait_until="networkidle")
    prepare(shown)
    shown.wait_for_load_state("networkidle")
    image = Image.open(io.BytesIO(shown.screenshot())).convert("RGB")
    context.close()
    return image


PARTS = {"gallery": gallery, "cookbook": cookbook, "layers": layers, "page": page}

if __name__ == "__main__":
    for part in sys.argv[1:] or ["gallery", "cookbook", "layers"]:
        PARTS[part]()
