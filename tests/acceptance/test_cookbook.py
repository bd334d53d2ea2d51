"""The scene cookbook: its scenes have no warnings, and its pictures are what the renderer makes of them."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from renderer.images.colors import linear_from_srgb
from tests.acceptance.conftest import ROOT, shell
from tests.pages import blocks
from tools.docs import render_cookbook
from tools.docs.render_cookbook import Recipe

PAGE = render_cookbook.PAGE.read_text(encoding="utf-8")
RECIPES = {recipe.name: recipe for recipe in render_cookbook.recipes()}

COARSER = 4
"""How much more error than on the page pictures may have here: they take a third of the time."""
BLOCK = 8
"""Pixels along a side: the mean of 64 has an eighth of their errors, so five targets are 0.6 of one."""

each_recipe = pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)


def kept(recipe: Recipe) -> NDArray[np.uint8]:
    """Codes (H, W, 3) of the picture on the page."""
    with Image.open(recipe.picture) as picture:
        return np.asarray(picture)


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


def test_each_scene_of_the_page_has_a_picture_and_each_picture_a_scene() -> None:
    assert len(RECIPES) == PAGE.count("```json\n") == PAGE.count("\n## ") == 12
    assert {path.name for path in render_cookbook.PICTURES.iterdir()} == {f"{name}.png" for name in RECIPES}


@each_recipe
def test_a_scene_of_the_page_is_valid_and_without_warnings(recipe: Recipe) -> None:
    assert recipe.load().warnings == ()


@each_recipe
def test_a_picture_has_the_size_that_its_scene_names(recipe: Recipe) -> None:
    camera = recipe.load().document.camera
    assert kept(recipe).shape == (camera.height, camera.width, 3)


@pytest.mark.slow
@each_recipe
def test_a_picture_is_what_the_renderer_makes_of_the_scene_now(recipe: Recipe) -> None:
    quality = recipe.quality.model_copy(update={"error": COARSER * recipe.quality.error})
    picture = replace(recipe, quality=quality).render()
    assert least_error(kept(recipe), picture) <= recipe.quality.error


def test_a_ball_of_another_colour_is_no_longer_the_same_picture() -> None:
    picture = kept(RECIPES["mirror"])
    ball = picture.copy()
    ball[175:185, 35:65] = 255 - ball[175:185, 35:65]
    assert least_error(picture, picture) == 0
    assert least_error(picture, ball) > RECIPES["mirror"].quality.error


@pytest.mark.slow
def test_the_commands_of_the_page_make_its_picture(tmp_path: Path) -> None:
    recipe = RECIPES["image"]
    shutil.copytree(ROOT / "scenes" / "gallery" / "textures", tmp_path / "scenes" / "gallery" / "textures")
    (tmp_path / "scene.json").write_text(recipe.scene)
    (commands,) = blocks(PAGE, "sh")
    done = shell(commands, tmp_path)
    assert done.stdout == "scene.json: ok\n"
    with Image.open(tmp_path / "scene.png") as picture:
        assert least_error(kept(recipe), np.asarray(picture)) <= recipe.quality.error
