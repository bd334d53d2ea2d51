"""Render every scene of the gallery into out/gallery, and small copies for the documentation.

Run it with ``make gallery``.
"""

from __future__ import annotations

import os
from pathlib import Path

from PIL import Image

import renderer
from renderer import image_files

ROOT = Path(__file__).parent.parent
SCENES = ROOT / "scenes" / "gallery"
PICTURES = ROOT / "out" / "gallery"
COPIES = ROOT / "docs" / "images" / "gallery"
WIDTH = 384
"""Columns of the copies, pixels."""


def main() -> None:
    """Render all scenes, one after another, in as many processes as there are cores."""
    for folder in (PICTURES, COPIES):
        folder.mkdir(parents=True, exist_ok=True)
    for scene in sorted(SCENES.glob("*.json")):
        plan = renderer.compile_scene(scene)
        result = renderer.render(plan, workers=os.cpu_count())
        picture = PICTURES / f"{scene.stem}.png"
        image_files.write_image(picture, result.image, plan.document.display)
        shrink(picture, COPIES / picture.name)
        print(f"{picture.relative_to(ROOT)}: {result.report['cpu_seconds']:.1f} CPU seconds")


def shrink(picture: Path, copy: Path) -> None:
    """Save a picture at the width of the copies, its shape kept."""
    with Image.open(picture) as image:
        height = round(image.height * WIDTH / image.width)
        image.resize((WIDTH, height), Image.Resampling.LANCZOS).save(copy, optimize=True)


if __name__ == "__main__":
    main()
