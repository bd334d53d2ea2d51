"""What the page offers to begin with is the gallery as it is."""

import json
from pathlib import Path

import pytest
from PIL import Image

from tests.architecture.sources import ROOT
from tools.docs import render_gallery

WEB = ROOT / "service" / "web"
ENTRIES = json.loads((WEB / "gallery.json").read_text())


def test_every_scene_of_the_gallery_is_offered_with_what_to_notice() -> None:
    assert {entry["name"]: entry["notice"] for entry in ENTRIES} == render_gallery.notices()
    assert {entry["name"] for entry in ENTRIES} == {
        path.stem for path in (ROOT / "scenes" / "gallery").glob("*.json")
    }


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry["name"])
def test_a_scene_is_offered_with_a_picture_of_the_stated_size(entry: dict[str, object]) -> None:
    with Image.open(WEB / "thumbnails" / f"{entry['name']}.webp") as image:
        assert image.size == (entry["width"], entry["height"])


SCRIPTS = [path for path in sorted(WEB.rglob("*.js")) if "vendor" not in path.parts]


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(WEB)))
def test_a_script_of_the_page_fits_in_one_head(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 400
