"""The scenes on the page of the cookbook are valid, and its pictures are what the renderer makes of them."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import renderer
from renderer.images.colors import linear_from_srgb
from renderer.images.files import displayed
from schemas.quality import TargetQuality
from tests.acceptance.conftest import ROOT
from tests.pages import page

PAGE = page("how-to/cookbook.md")
(ERROR,) = map(float, re.findall(r"(?m)^penumbra render .* --target-error (\S+)$", PAGE))
COARSER = 4
"""How much more error than on the page pictures may have here: they take a third of the time."""
BLOCK = 8
"""Pixels along a side: the mean of 64 has an eighth of their errors, so five targets are 0.6 of one."""


class Recipe(NamedTuple):
    name: str
    scene: str

    def load(self) -> renderer.LoadedScene:
        return renderer.load_scene(self.scene.encode(), assets=ROOT)

    def picture(self) -> NDArray[np.uint8]:
        """Codes (H, W, 3) of the picture on the page."""
        with Image.open(ROOT / "docs" / "images" / "cookbook" / f"{self.name}.png") as picture:
            return np.asarray(picture)


RECIPE = re.compile(r"(?ms)^!\[[^]]+\]\(\.\./images/cookbook/([\w-]+)\.png\)\n.*?^```json\n(.*?)^```")
RECIPES = [Recipe(*found) for found in RECIPE.findall(PAGE)]
each_recipe = pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)


@each_recipe
def test_recipe_is_valid_and_its_picture_has_its_size(recipe: Recipe) -> None:
    loaded = recipe.load()
    camera = loaded.document.camera
    assert loaded.warnings == ()
    assert recipe.picture().shape == (camera.height, camera.width, 3)


@pytest.mark.slow
@each_recipe
def test_recipe_gives_its_picture(recipe: Recipe) -> None:
    loaded = recipe.load()
    plan = renderer.compile_scene(loaded, TargetQuality(mode="target", error=COARSER * ERROR))
    picture = displayed(renderer.render(plan).image, loaded.document.display)
    assert least_error(recipe.picture(), picture) <= ERROR


def least_error(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Smallest RMSE that means of blocks can have in two linear pictures which are displayed as these codes.

    A code leaves half a step to either side open, so equal and neighbouring codes count nothing.
    """
    low = linear_from_srgb(np.maximum(a, b) / 255 - 0.5 / 255)
    high = linear_from_srgb(np.minimum(a, b) / 255 + 0.5 / 255)
    differences = np.copysign(np.fmax(low - high, 0), a.astype(float) - b)
    height, width = (side // BLOCK for side in a.shape[:2])
    blocks = differences[: height * BLOCK, : width * BLOCK].reshape(height, BLOCK, width, BLOCK, 3)
    return float(np.sqrt(np.mean(blocks.mean(axis=(1, 3)) ** 2)))
