"""Target quality through a lens: kept, honest, unbiased, and the same for any tiles."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import renderer
from schemas.quality import FixedQuality, TargetQuality
from tests.documents import bulb, lamp, phong, rectangle, scene, sphere
from tests.pictures.references import CONVERGED

SEEDS = range(20)
ERROR = 3 / 255
MOST_MISSED = 5
"""Of 20 targets that are each kept with 95 in 100, six or more are missed once in 3,000 runs."""

FLOOR = rectangle([-15, 0, 11], [30, 0, 0], [0, 0, -30])
BOARD = {"type": "checker", "even": [0.8, 0.8, 0.75], "odd": [0.15, 0.2, 0.25], "repeat": [20, 20]}
MATERIALS = {"plain": phong(color=[0.7, 0.4, 0.2]), "board": phong(color_texture="board")}


def through(radius: float, *shapes: dict[str, Any], lights: list[dict[str, Any]]) -> dict[str, Any]:
    view = {"position": [0, 1.2, 6], "look_at": [0, 0.8, 0], "vertical_fov": 40, "width": 48, "height": 48}
    view |= {"lens_radius": radius, "focus_distance": 6.0}
    parts = {"materials": MATERIALS, "textures": {"board": BOARD}}
    return scene(*shapes, camera=view, lights=lights, **parts)


SCENES = {
    "board": through(
        0.15,
        FLOOR | {"material": "board"},
        sphere([-0.8, 0.7, 2], 0.7),
        sphere([0.8, 0.7, -3], 0.7),
        lights=[bulb([2, 6, 5])],
    ),
    "soft": through(
        0.3,
        FLOOR,
        sphere([-0.7, 0.6, 2.5], 0.5),
        sphere([0.6, 0.8, 0], 0.8),
        lights=[lamp([1, 5, 2], [2, 0, 0], [0, 0, 2])],
    ),
}
TARGET = TargetQuality(mode="target", error=ERROR)


def rendered(
    name: str, seed: int, quality: TargetQuality | FixedQuality, **options: Any
) -> renderer.RenderResult:
    document = SCENES[name] | {"sampling": {"seed": seed}}
    return renderer.render(renderer.compile_scene(document, quality), **options)


def clipped(result: renderer.RenderResult) -> np.ndarray:
    return np.clip(result.image, 0, 1).astype(np.float64)


@cache
def references(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Two independent converged pictures."""
    first, second = (clipped(rendered(name, seed, CONVERGED)) for seed in (1001, 1002))
    return first, second


@cache
def pictures(name: str) -> list[tuple[np.ndarray, dict[str, float]]]:
    """A picture for each seed, and the error that it reports."""
    results = [rendered(name, seed, TARGET) for seed in SEEDS]
    return [(clipped(result), result.report["error"]) for result in results]


def squares(name: str) -> np.ndarray:
    """Mean squared errors of the pictures, without bias by the references' own errors."""
    first, second = references(name)
    return np.array([((image - first) * (image - second)).mean() for image, _ in pictures(name)])


@pytest.mark.parametrize("tile_size", [16, 23])
def test_lens_picture_is_free_of_tiles(tile_size: int) -> None:
    whole = rendered("soft", 1, TARGET).image
    assert rendered("soft", 1, TARGET, tile_size=tile_size).image.tobytes() == whole.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_lens_targets_are_kept(name: str) -> None:
    assert np.count_nonzero(squares(name) > ERROR**2) <= MOST_MISSED


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_lens_errors_are_honest(name: str) -> None:
    reported = np.array([error["estimate"] ** 2 for _, error in pictures(name)])
    true = squares(name)
    apart = reported - true
    # Rendering stops at a lucky estimate, which makes it too low in the mean; no more than by a quarter.
    allowed = 0.25 * true.mean() + 3 * apart.std(ddof=1) / np.sqrt(len(SEEDS))
    assert apart.std(ddof=1) / np.sqrt(len(SEEDS)) < 0.15 * true.mean()
    assert abs(apart.mean()) < allowed


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_lens_pictures_are_unbiased(name: str) -> None:
    first, second = references(name)
    means = np.array([(image - (first + second) / 2).mean() for image, _ in pictures(name)])
    deviation = means.std(ddof=1) / np.sqrt(len(SEEDS))
    assert deviation < ERROR / 64
    assert abs(means.mean()) < ERROR / 16 + 3 * deviation
