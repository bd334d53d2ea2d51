"""Scenes small enough to render while a test waits, as text that a person might have written."""

import json
from base64 import b64encode
from pathlib import Path
from typing import Any

import httpx2
from playwright.sync_api import Locator, Page, expect

from tests.service.support import submit, until

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


PASTE = """(element, text) => {
  const clipboardData = new DataTransfer();
  clipboardData.setData("text/plain", text);
  element.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
}"""
# The lines that are out of sight are no elements: the editor itself knows the whole text.
VIEW = """async (wanted) => {
  const { EditorView } = await import("/web/vendor/codemirror/codemirror.js");
  const { state } = EditorView.findFromDOM(document.querySelector(".editor"));
  const { from, to } = state.selection.main;
  const text = state.doc.toString();
  return { text, selected: text.slice(from, to), same: text === wanted };
}"""


def write(page: Page, text: str) -> None:
    """Paste a text into the editor in place of its own, and go to its beginning."""
    editor(page).press("Control+A")
    editor(page).evaluate(PASTE, text)
    editor(page).press("Control+Home")


def go_to_problem(page: Page, line: int) -> None:
    """Click on a problem below the editor, which brings its line into sight."""
    page.get_by_role("button", name=f"Line {line} ").click(timeout=TIMEOUT)


def expect_written(page: Page, text: str) -> None:
    """Wait until this text is in the editor."""
    expect(editor(page)).to_be_visible(timeout=TIMEOUT)
    # Not by `wait_for_function`, for which the promise of an async function is true.
    until(lambda: page.evaluate(VIEW, text)["same"])


def selected(page: Page) -> str:
    """The selected text of the editor."""
    return str(page.evaluate(VIEW, "")["selected"])


def ask_for_samples(page: Page, camera: int, light: int) -> None:
    page.get_by_role("radio", name="Samples").check()
    page.get_by_label("Samples per pixel").fill(str(camera))
    page.get_by_label("Samples per light").fill(str(light))


def render_button(page: Page) -> Locator:
    return page.get_by_role("button", name="Render", exact=True)


def opened(page: Page) -> None:
    """Wait until the page has found its scene to be good, the first one it shows among them."""
    expect(render_button(page)).to_be_enabled(timeout=TIMEOUT)


def choose(page: Page, title: str) -> None:
    """Open a scene of the gallery."""
    page.get_by_role("button", name="Open a scene").click()
    page.get_by_role("button", name=title, exact=True).click()


DROP = """async ([onto, files]) => {
  const transfer = new DataTransfer();
  for (const [name, bytes] of Object.entries(files)) {
    transfer.items.add(new File([Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0))], name));
  }
  const event = (type) => new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true });
  const target = document.querySelector(onto);
  target.dispatchEvent(event("dragover"));
  target.dispatchEvent(event("drop"));
}"""


def drop(page: Page, *, onto: str = "body", **files: bytes) -> None:
    """Drop files on the page or on the element of a selector; `__` in a name stands for the dot."""
    named = {name.replace("__", "."): b64encode(content).decode() for name, content in files.items()}
    page.evaluate(DROP, [onto, named])
