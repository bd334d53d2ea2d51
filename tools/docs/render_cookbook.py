"""Render the pictures of docs/how-to/cookbook.md from the scenes that are written there.

Run it with ``make gallery``. Names of pictures after the command render only these:
``python -m tools.docs.render_cookbook glass mirror``.
"""

from __future__ import annotations

import io
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

import renderer
from renderer.images.files import displayed
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
"""Scenes of the page name files of the repository, so they are rendered as if they lay in its folder."""
PAGE = ROOT / "docs" / "how-to" / "cookbook.md"
PICTURES = ROOT / "docs" / "images" / "cookbook"
RECIPE = re.compile(
    r"^!\[(?P<shows>[^]]+)\]\(\.\./images/cookbook/(?P<name>[\w-]+)\.png\)\n.*?^```json\n(?P<scene>.*?)^```",
    re.MULTILINE | re.DOTALL,
)
TARGET_ERROR = re.compile(r"^penumbra render .* --target-error (\S+)$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Recipe:
    """A picture of the page and the scene below it."""

    name: str
    scene: str
    quality: TargetQuality

    @property
    def picture(self) -> Path:
        """The file that the page shows."""
        return PICTURES / f"{self.name}.png"

    def load(self) -> renderer.LoadedScene:
        """Read and check the scene."""
        return renderer.load_scene(self.scene.encode(), assets=ROOT)

    def render(self) -> NDArray[np.uint8]:
        """Pixels of the picture (H, W, 3), as the page's command makes them."""
        loaded = self.load()
        plan = renderer.compile_scene(loaded, self.quality)
        image = renderer.render(plan, workers=os.cpu_count()).image
        return displayed(image, loaded.document.display)


def recipes() -> list[Recipe]:
    """All recipes of the page, in its order, with the quality of its command."""
    page = PAGE.read_text(encoding="utf-8")
    (error,) = TARGET_ERROR.findall(page)
    quality = TargetQuality(mode="target", error=float(error))
    return [Recipe(found["name"], found["scene"], quality) for found in RECIPE.finditer(page)]


def main(names: list[str]) -> None:
    """Write the named pictures, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for recipe in recipes():
        if names and recipe.name not in names:
            continue
        content = io.BytesIO()
        Image.fromarray(recipe.render()).save(content, format="PNG", optimize=True)
        recipe.picture.write_bytes(content.getvalue())
        print(recipe.picture.relative_to(ROOT))


if __name__ == "__main__":
    main(sys.argv[1:])
