"""Photograph the live page for the documentation: a job of the gallery with an error of half a code value.

Run it with ``python -m tools.docs.make_page_picture``, on a machine with Chromium and the extra ``test``.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

import httpx2
from playwright.sync_api import sync_playwright

from service.server import running
from service.settings import Settings

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "gallery" / "basic.json"
PICTURE = ROOT / "docs" / "images" / "page.png"
QUALITY = {"mode": "target", "error": 0.002}
LAYERS = ["depth", "normal", "shape", "samples", "error"]
SIZE = {"width": 1200, "height": 940}


def main() -> None:
    """Start a service, render the scene, open the page of the job, and keep what it looks like."""
    with tempfile.TemporaryDirectory() as data, running(_settings(Path(data))) as server:
        photograph(server.url, submit(server.url))


def _settings(data: Path) -> Settings:
    return Settings(data=data, port=0, log_level="error")


def submit(url: str) -> str:
    """Render the scene; the path of its page."""
    scene = json.loads(SCENE.read_text())
    request = {"scene": scene, "quality": QUALITY, "layers": LAYERS}
    answer = httpx2.post(f"{url}/v1/jobs", json=request, headers={"Prefer": "wait=60"}, timeout=90)
    return f"/jobs/{answer.raise_for_status().json()['id']}"


def photograph(url: str, path: str) -> None:
    """Open the page in the browser of this machine and save what it shows."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_context(viewport=SIZE).new_page()
        page.goto(url + path, wait_until="networkidle")
        page.locator(".plot canvas").wait_for()
        page.screenshot(path=PICTURE)
        browser.close()


if __name__ == "__main__":
    main()
