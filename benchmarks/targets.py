"""Whether pictures of target quality keep what they were asked for, and know how far off they are."""

from __future__ import annotations

import json
import statistics
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

import renderer
from benchmarks.machine import cpu_seconds
from benchmarks.references import SCENES
from renderer.assets import FolderAssets
from schemas.quality import FixedQuality, TargetQuality

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

GALLERY = SCENES.parent / "gallery"

PATHS = (
    *(SCENES / f"{name}.json" for name in ("soft", "chess", "lamp")),
    *(
        GALLERY / f"{name}.json"
        for name in (
            "antialiasing_rotated",
            "basic",
            "falloff",
            "filtering",
            "glass",
            "lens",
            "mirror",
            "normal_texturing",
            "relief",
            "texturing",
        )
    ),
)
"""What is rendered.

Meshes are left out, as their references take an hour, and `mipmap`, whose texture is blurred the less the
more samples a pixel of fixed quality has: its references show another picture."""

ERRORS_255 = (4.0, 2.0, 1.0, 0.5)
"""What is asked for, in units of 1/255."""

SIDE = 96
"""The longer side of the pictures, pixels."""

CONVERGED = FixedQuality.model_validate(
    {
        "mode": "fixed",
        "antialiasing": {"pattern": "sobol", "samples": 256},
        "light": {"pattern": "sobol", "samples": 4},
    }
)
"""Of each half of a reference."""

SEEDS = 1, 2
"""Of the two halves of a reference. No scene has them itself."""


class Pair(TypedDict):
    """A scene at a target; errors are those of linear values clipped to 0..1 in units of 1/255.

    `estimate`, `low` and `high` are what the picture says of its own error, `true` is what the reference
    says, whose own error is `reference` and does not count.
    """

    scene: str
    target: float
    estimate: float
    low: float
    high: float
    true: float
    mean_difference: float
    reference: float
    cpu_seconds: float


class Summary(TypedDict):
    """Shares, 0 to 1, of the pairs that kept the target and whose interval holds the true error."""

    pairs: int
    kept: float
    held: float
    median_ratio: float


class Targets(TypedDict):
    """All pairs, and what they come to."""

    pairs: list[Pair]
    summary: Summary


def measure() -> Targets:
    """Render every scene at every target once, in one process, after its reference."""
    pairs = [pair for path in PATHS for pair in _pairs(path)]
    return Targets(pairs=pairs, summary=summary(pairs))


def summary(pairs: list[Pair]) -> Summary:
    """What pairs come to."""
    return Summary(
        pairs=len(pairs),
        kept=_share([pair["true"] <= pair["target"] for pair in pairs]),
        held=_share([pair["low"] <= pair["true"] <= pair["high"] for pair in pairs]),
        median_ratio=round(statistics.median(pair["true"] / pair["target"] for pair in pairs), 3),
    )


def _share(answers: list[bool]) -> float:
    return round(sum(answers) / len(answers), 3)


def _pairs(path: Path) -> list[Pair]:
    document = small(json.loads(path.read_text(encoding="utf-8")), SIDE)
    halves = [converged(document, path.parent, seed) for seed in SEEDS]
    return [_pair(path, document, error, halves) for error in ERRORS_255]


def small(document: dict[str, Any], side: int) -> dict[str, Any]:
    """A scene document whose picture has `side` pixels along its longer side."""
    camera = document["camera"]
    scale = side / max(camera["width"], camera["height"])
    sizes = {name: round(camera[name] * scale) for name in ("width", "height")}
    return {**document, "camera": {**camera, **sizes}}


def converged(document: dict[str, Any], folder: Path, seed: int) -> NDArray[np.float32]:
    """Half of a reference, (H, W, 3)."""
    seeded = {**document, "sampling": {**document["sampling"], "seed": seed}}
    scene = renderer.load_scene(seeded, assets=FolderAssets(folder))
    return renderer.render(renderer.compile_scene(scene, CONVERGED)).image


def _pair(path: Path, document: dict[str, Any], error: float, halves: list[NDArray[np.float32]]) -> Pair:
    scene = renderer.load_scene(document, assets=FolderAssets(path.parent))
    plan = renderer.compile_scene(scene, TargetQuality(mode="target", error=error / 255))
    begun = cpu_seconds()
    result = renderer.render(plan)
    seconds = cpu_seconds() - begun
    known = {name: round(255 * value, 4) for name, value in result.report["error"].items()}
    first, second = (255 * (clipped(result.image) - clipped(half)) for half in halves)
    return Pair(
        scene=path.stem,
        target=error,
        estimate=known["estimate"],
        low=known["low"],
        high=known["high"],
        true=round(root_of_product(first, second), 4),
        mean_difference=round(float(np.mean((first + second) / 2)), 4),
        reference=round(float(np.sqrt(np.mean((first - second) ** 2)) / 2), 4),
        cpu_seconds=round(seconds, 3),
    )


def clipped(image: ArrayLike) -> NDArray[np.float64]:
    """Linear values as errors are defined for them."""
    return np.clip(np.asarray(image, dtype=np.float64), 0.0, 1.0)


def root_of_product(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Root mean square of what two differences have in common.

    The two are of one picture from two references. Their own errors know nothing of each other, so in the
    mean of the products they leave no bias.

    Examples
    --------
    >>> root_of_product(np.array([3.0, -2.0]), np.array([1.0, -0.5]))
    1.4142135623730951
    """
    return float(np.sqrt(max(float(np.mean(first * second)), 0.0)))
