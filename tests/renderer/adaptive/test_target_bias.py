"""Pictures of target quality are neither too bright nor too dark.

What is tried is the mean over all pixels and channels of the difference from a converged reference, both
clipped to 0..1, averaged over pictures of several seeds. Exactly 0 it need not be: interpolation, pilot
samples with few light points and the grids on lights err alike for every seed. So the mean may be off by 4.9
standard errors or by a sixteenth of the target, whichever is more. A mean that far off makes 1/256 of the
squared error that was requested, so nearly all of that is noise.

Seeds are fixed. The standard error is that of the mean over ten seeds, from their spread, with that of the
reference, from its two halves. Beyond 4.9 of such errors (Student's t with 9 degrees of freedom) a picture
without any bias is once in 1,200 times.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.statistics import clipped
from renderer.assets import FolderAssets
from schemas.quality import TargetQuality
from tests.pictures.references import CONVERGED, SCENES, small

pytestmark = pytest.mark.slow

PATHS = {
    Path(name).stem: SCENES / f"{name}.json"
    for name in (
        "study/soft",
        "study/chess",
        "study/lamp",
        "gallery/basic",
        "gallery/texturing",
        "gallery/lens",
    )
}
SIDE = 32
"""With so many pixels, too, 4.9 standard errors of ten pictures are less than the share of a target."""
SEEDS = range(1, 11)
HALVES = 1001, 1002
STANDARD_ERRORS = 4.9
SHARE = 1 / 16


@dataclass(frozen=True)
class Reference:
    """A converged picture, (H, W, 3), and the standard error of its mean."""

    image: np.ndarray
    uncertain: float


def document(name: str, seed: int) -> dict[str, Any]:
    found = small(json.loads(PATHS[name].read_text(encoding="utf-8")), SIDE)
    return found | {"sampling": {**found["sampling"], "seed": seed}}


@cache
def reference(name: str) -> Reference:
    """Pixels err independently, each as far as its two halves are apart."""
    assets = FolderAssets(PATHS[name].parent)
    scenes = [renderer.load_scene(document(name, seed), assets=assets) for seed in HALVES]
    plans = [renderer.compile_scene(scene, CONVERGED) for scene in scenes]
    first, second = (clipped(renderer.render(plan).image) for plan in plans)
    apart = ((first - second) / 2).mean(axis=2)
    return Reference((first + second) / 2, float(np.sqrt((apart**2).sum())) / apart.size)


def difference(name: str, seed: int, error: float) -> float:
    """How much brighter than the reference the picture of a seed is in the mean."""
    scene = renderer.load_scene(document(name, seed), assets=FolderAssets(PATHS[name].parent))
    plan = renderer.compile_scene(scene, TargetQuality(mode="target", error=error))
    return float((clipped(renderer.render(plan).image) - reference(name).image).mean())


@pytest.mark.parametrize(
    ("name", "error_255"),
    [(name, error) for name in ("soft", "chess", "lamp", "basic", "texturing") for error in (1, 4)]
    + [("lens", 4)],
)
def test_pictures_are_unbiased(name: str, error_255: float) -> None:
    found = np.array([difference(name, seed, error_255 / 255) for seed in SEEDS])
    standard_error = np.hypot(found.std(ddof=1) / np.sqrt(found.size), reference(name).uncertain)
    allowed = max(STANDARD_ERRORS * standard_error, SHARE * error_255 / 255)
    assert abs(found.mean()) <= allowed
