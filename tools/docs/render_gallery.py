"""Render every scene of the gallery and every hard one into out, and small copies for documents and the page.

Run it with ``make gallery``.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

from PIL import Image

import renderer
from renderer.images import files as image_files

ROOT = Path(__file__).parents[2]
SCENES = ROOT / "scenes"
PICTURES = ROOT / "out"
COPIES = ROOT / "docs" / "images"
FOLDERS = ("gallery", "hard")
WIDTH = 384
"""Most columns of the copies, pixels."""
WEB = ROOT / "service" / "web"
THUMBNAIL_WIDTH = 256
"""Columns of the pictures from which people choose a scene on the page, pixels."""


def main() -> None:
    """Render all scenes, one after another, in as many processes as there are cores."""
    for folder in FOLDERS:
        for place in (PICTURES / folder, COPIES / folder):
            place.mkdir(parents=True, exist_ok=True)
        for scene in sorted((SCENES / folder).glob("*.json")):
            draw(scene, PICTURES / folder / f"{scene.stem}.png", COPIES / folder / f"{scene.stem}.png")
    choices()


def choices() -> None:
    """Make what the page offers to begin with: small pictures of the gallery, and what to notice in each."""
    (WEB / "thumbnails").mkdir(exist_ok=True)
    entries = [choice(name, notice) for name, notice in notices().items()]
    (WEB / "gallery.json").write_text(json.dumps(entries, indent=2) + "\n")


def notices() -> dict[str, str]:
    """What to notice in each scene of the gallery, by its name, as its README says it and in its order."""
    table = (SCENES / "gallery" / "README.md").read_text()
    found = re.findall(r"^\| \[(\w+)\.json\]\(\S+\) \| (.+) \|$", table, re.MULTILINE)
    return {name: notice.replace("`", "") for name, notice in found}


def choice(name: str, notice: str) -> dict[str, Any]:
    """Make the small picture of a scene, and say what the page says of it."""
    picture = WEB / "thumbnails" / f"{name}.webp"
    with Image.open(COPIES / "gallery" / f"{name}.png") as image:
        height = round(image.height * THUMBNAIL_WIDTH / image.width)
        small = image.convert("RGB").resize((THUMBNAIL_WIDTH, height), Image.Resampling.LANCZOS)
        small.save(picture, quality=85, method=6)
    title = name.replace("_", " ").capitalize()
    return {"name": name, "title": title, "notice": notice, "width": THUMBNAIL_WIDTH, "height": height}


def draw(scene: Path, picture: Path, copy: Path) -> None:
    """Render one scene, save its picture and a small copy."""
    plan = renderer.compile_scene(scene)
    result = renderer.render(plan, workers=os.cpu_count())
    image_files.write_image(picture, result.image, plan.document.display)
    shrink(picture, copy)
    print(f"{picture.relative_to(ROOT)}: {result.report['cpu_seconds']:.1f} CPU seconds")


def shrink(picture: Path, copy: Path) -> None:
    """Save a picture at the width of the copies or less, its shape kept."""
    with Image.open(picture) as image:
        width = min(WIDTH, image.width)
        height = round(image.height * width / image.width)
        image.resize((width, height), Image.Resampling.LANCZOS).save(copy, optimize=True)


if __name__ == "__main__":
    main()
