"""Scenes small enough to render while a test waits, as text that a person might have written."""

from __future__ import annotations

import json
from base64 import b64encode
from pathlib import Path
from typing import Any

import httpx2
from playwright.sync_api import Locator, Page, expect

from tests.integration.support import submit

GALLERY = Path(__file__).parents[2] / "scenes" / "gallery"
# A worker may be busy with another test's job, and a machine with other work.
TIMEOUT = 60_000
ENDLESS_SIDE = 512


def small(scene: str = "texturing", /, **changes: Any) -> str:
    """A scene of the gallery at 32 x 32 pixels with one sample, its lines as they are in the gallery."""
    document = json.loads((GALLERY / f"{scene}.json").read_text())
    document["camera"] |= {"width": 32, "height": 32}
    document["sampling"] = {"antialiasing": {"pattern": "center"}, "light": {"samples": 1}}
    return json.dumps(document | changes, indent=2)


def endless(client: httpx2.Client, name: str) -> str:
    """Submit a job that no test sees the end of: tiles of its later passes take many seconds."""
    large = json.loads(small("basic", name=name))
    large["camera"] |= {"width": ENDLESS_SIDE, "height": ENDLESS_SIDE}
    samples = {"pattern": "sobol", "samples": 4096}, {"pattern": "sobol", "samples": 256}
    return submit(client, large, quality={"mode": "fixed", "antialiasing": samples[0], "light": samples[1]})


def line_of(text: str, part: str) -> int:
    """The line on which a part of a text stands first, from 1."""
    return text[: text.index(part)].count("\n") + 1


def editor(page: Page) -> Locator:
    return page.get_by_role("textbox", name="Scene, as JSON")


def render_button(page: Page) -> Locator:
    return page.get_by_role("button", name="Render", exact=True)


def opened(page: Page) -> None:
    """Wait until the page has found its scene to be good, the first one it shows among them."""
    expect(render_button(page)).to_be_enabled(timeout=TIMEOUT)


DROP = """async (files) => {
  const transfer = new DataTransfer();
  for (const [name, bytes] of Object.entries(files)) {
    transfer.items.add(new File([Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0))], name));
  }
  const event = (type) => new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true });
  document.body.dispatchEvent(event("dragover"));
  document.body.dispatchEvent(event("drop"));
}"""


def drop(page: Page, **files: bytes) -> None:
    """Drop files on the page; a double underscore in a name stands for the dot."""
    named = {name.replace("__", "."): b64encode(content).decode() for name, content in files.items()}
    page.evaluate(DROP, named)
