"""How often the reported interval of one scene holds its true error, seed by seed.

``python -m benchmarks.intervals --out docs/figures/intervals.json`` renders the pictures and keeps the
figures, which a diagram shows.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypedDict

import renderer
from benchmarks.machine import Machine, describe
from benchmarks.references import SCENES
from benchmarks.scaling import small
from benchmarks.targets import Reference
from schemas.quality import TargetQuality

SCENE, SIDE, TARGET_255 = "soft", 96, 1.0
SEEDS = range(101, 151)
"""Consecutive, so that none is chosen, and none of those that references have."""

KEPT = Path(__file__).parents[1] / "docs" / "figures" / "intervals.json"


class Picture(TypedDict):
    """What the picture of a seed reports and, from the references, has; in units of 1/255."""

    seed: int
    estimate: float
    low: float
    high: float
    true: float


class Intervals(TypedDict):
    """All pictures of a scene, `side` pixels wide, with a target error in units of 1/255."""

    machine: Machine
    scene: str
    side: int
    target: float
    pictures: list[Picture]


def measure() -> Intervals:
    """Render the scene once for each seed."""
    with TemporaryDirectory() as folder:
        reference = Reference(_document(0), Path(folder))
        pictures = [picture(seed, reference) for seed in SEEDS]
    return Intervals(machine=describe(), scene=SCENE, side=SIDE, target=TARGET_255, pictures=pictures)


def picture(seed: int, reference: Reference) -> Picture:
    """Render a seed, and compare it with the reference."""
    result = rendered(seed)
    known = {name: round(255 * result.report["error"][name], 4) for name in ("estimate", "low", "high")}
    true, _ = reference.error_of(result.image, TARGET_255 / 255)
    return Picture(
        seed=seed,
        estimate=known["estimate"],
        low=known["low"],
        high=known["high"],
        true=round(255 * true, 4),
    )


def rendered(seed: int) -> renderer.RenderResult:
    """The picture of a seed with its report."""
    plan = renderer.compile_scene(
        renderer.load_scene(_document(seed)), TargetQuality(mode="target", error=TARGET_255 / 255)
    )
    return renderer.render(plan)


def _document(seed: int) -> dict[str, Any]:
    document = small(json.loads((SCENES / f"{SCENE}.json").read_text(encoding="utf-8")), SIDE)
    return document | {"sampling": {**document.get("sampling", {}), "seed": seed}}


def main() -> None:
    """Measure, and write the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.intervals")
    parser.add_argument("--out", type=Path, default=KEPT, help="where to write the figures")
    parser.parse_args().out.write_text(json.dumps(measure(), indent=1) + "\n")


if __name__ == "__main__":
    main()
