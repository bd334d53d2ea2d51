"""Computations of the page agree with the service: places in JSON, and hashes of files."""

import hashlib
import json
from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page

from schemas.pointers import Parts, pointer
from schemas.reading.positions import line_and_column, locate
from tests.browser.conftest import ROOT

SCENES = sorted((ROOT / "scenes" / "gallery").glob("*.json"))
PLACES = """async ([text, pointers]) => {
  const { places } = await import("/web/json_text.js");
  const found = Array.from(places(text, pointers));
  return Object.fromEntries(found.map(([at, { line, column }]) => [at, [line, column]]));
}"""


def locations(value: Any, parts: Parts = ()) -> Iterator[Parts]:
    """Every location of a document."""
    yield parts
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, inner in items:
        yield from locations(inner, (*parts, name))


def expected(text: str) -> dict[str, list[int]]:
    """Lines and columns of all locations, of their keys where they have any."""
    found = locate(text, locations(json.loads(text)))
    return {
        pointer(parts): list(line_and_column(text, place.keys[-1] if place.keys else place.value))
        for parts, place in found.items()
    }


def places(page: Page, text: str, pointers: list[str]) -> dict[str, list[int]]:
    return page.evaluate(PLACES, [text, pointers])


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_pointers_lead_to_their_lines(bare_page: Page, path: Path) -> None:
    text = path.read_text()
    wanted = expected(text)
    assert places(bare_page, text, list(wanted)) == wanted


# Lengths around full blocks, FIPS 180-4 section 5.1.1.
@pytest.mark.slow
@pytest.mark.parametrize("length", [0, 1, 55, 56, 63, 64, 119, 120, 100_000])
def test_hash_without_the_browsers(bare_page: Page, length: int) -> None:
    content = bytes((7 * i + i // 251) % 256 for i in range(length))
    found = bare_page.evaluate(
        """async (encoded) => {
          const { sha256 } = await import("/web/sha256.js");
          return sha256(Uint8Array.from(atob(encoded), (letter) => letter.charCodeAt(0)).buffer, null);
        }""",
        b64encode(content).decode(),
    )
    assert found == hashlib.sha256(content).hexdigest()
