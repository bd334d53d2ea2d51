"""Render every scene of the gallery and every hard one into out, and small copies for the documentation.

Run it with ``make gallery``.
"""

from __future__ import annotations

import os
from pathlib import Path

from PIL import Image

import renderer
from renderer import image_files

ROOT = Path(__file__).parent.parent
SCENES = ROOT / "scenes"
PICTURES = ROOT / "out"
COPIES = ROOT / "docs" / "images"
FOLDERS = ("gallery", "hard")
WIDTH = 384
"""Most columns of the copies, pixels."""


def main() -> None:
    """Render all scenes, one after another, in as many processes as there are cores."""
    for folder in FOLDERS:
        for place in (PICTURES / folder, COPIES / folder):
            place.mkdir(parents=True, exist_ok=True)
        for scene in sorted((SCENES / folder).glob("*.json")):
            draw(scene, PICTURES / folder / f"{scene.stem}.png", COPIES / folder / f"{scene.stem}.png")


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
