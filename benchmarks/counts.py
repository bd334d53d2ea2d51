"""Counted work of small pictures against the counts that are kept: rays, calls of NumPy, elements computed.

    python -m benchmarks.counts           # exits with 1 where a picture takes more than is kept
    python -m benchmarks.counts --store   # keeps the counts of today, in benchmarks/counts.json

Counts are the same on a busy machine and on an idle one, so they are compared exactly. CPU seconds are not:
they are shown as multiples of a yardstick of NumPy on the same machine, and nothing fails by them. Another
release of NumPy may count otherwise: then everything is shown, and nothing fails.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TypedDict

import numpy as np
from rich.console import Console
from rich.table import Table

import renderer
from accuracy.variations import fixed_quality
from benchmarks.counted_arrays import counting
from scenes import scene_path
from schemas.quality import FixedQuality, TargetQuality

KEPT = Path(__file__).with_name("counts.json")
SIDE = 48
"""Small pictures run every stage, and are counted in seconds."""

QUALITIES: dict[str, FixedQuality | TargetQuality] = {
    "uniform": fixed_quality("uniform", 4, "uniform", 16),
    "sobol": fixed_quality("sobol", 4, "sobol", 4),
    "target": TargetQuality(mode="target", error=0.02),
}
PICTURES = {
    "soft shadows": ("study/soft", "uniform"),
    "shadows of many triangles": ("study/shell", "uniform"),
    "random samples": ("study/chess", "sobol"),
    "textures and normal maps": ("gallery/normal_texturing", "uniform"),
    "mirror": ("gallery/mirror", "uniform"),
    "glass": ("gallery/glass", "uniform"),
    "lens": ("gallery/lens", "sobol"),
    "target quality": ("gallery/basic", "target"),
}
"""What is counted: a scene and its quality, by the effect that it stands for."""


class Counts(TypedDict):
    """The counted work of one picture, and its CPU seconds in yardsticks."""

    rays: dict[str, int]
    calls: int
    elements: int
    yardsticks: float


class Run(TypedDict):
    """The counts of all pictures, and the release of NumPy that they belong to."""

    numpy: str
    pictures: dict[str, Counts]


def plan_of(scene: str, quality: str) -> renderer.RenderPlan:
    """Compile a small form of a scene."""
    loaded = renderer.load_scene(scene_path(scene))
    camera = loaded.document.camera.model_copy(update={"width": SIDE, "height": SIDE})
    small = replace(loaded, document=loaded.document.model_copy(update={"camera": camera}))
    return renderer.compile_scene(small, QUALITIES[quality])


def yardstick() -> float:
    """CPU seconds of a fixed work of NumPy: the shortest of a few, as other programs only make it longer."""
    values = np.linspace(1.0, 2.0, 200_000)

    def once() -> float:
        begun = time.process_time()
        for _ in range(20):
            np.sqrt(values * values + 1.0).sum()
        return time.process_time() - begun

    return min(once() for _ in range(5))


def counts_of(plan: renderer.RenderPlan, unit: float) -> Counts:
    """Render a picture twice: once for its seconds, once for its counts."""
    begun = time.process_time()
    report = renderer.render(plan, workers=1).report
    seconds = time.process_time() - begun
    with counting() as tally:
        renderer.render(plan, workers=1)
    return Counts(
        rays=dict(report["rays"]),
        calls=tally.calls.total(),
        elements=tally.elements.total(),
        yardsticks=round(seconds / unit, 1),
    )


def run() -> Run:
    """Count every picture."""
    unit = yardstick()
    pictures = {name: counts_of(plan_of(*what), unit) for name, what in PICTURES.items()}
    return Run(numpy=np.__version__, pictures=pictures)


def flat(counts: Counts) -> dict[str, int]:
    """What is compared exactly, each with its name.

    >>> flat({"rays": {"camera": 4}, "calls": 7, "elements": 90, "yardsticks": 1.5})
    {'calls': 7, 'elements': 90, 'camera rays': 4}
    """
    rays = {f"{kind} rays": count for kind, count in counts["rays"].items()}
    return {"calls": counts["calls"], "elements": counts["elements"]} | rays


def regressions(found: Run, kept: Run) -> list[str]:
    """What takes more than is kept, in words; a picture that is not kept takes more than nothing."""
    return [
        f"{name}: {what} {before:,} -> {now:,}"
        for name, counts in found["pictures"].items()
        for what, now in flat(counts).items()
        if now > (before := _kept(kept, name).get(what, 0))
    ]


def _kept(kept: Run, name: str) -> dict[str, int]:
    return flat(kept["pictures"][name]) if name in kept["pictures"] else {}


def comparable(found: Run, kept: Run) -> bool:
    """Whether both were counted with one minor release of NumPy, such as 2.4."""
    first, second = (run["numpy"].split(".")[:2] for run in (found, kept))
    return first == second


def table(found: Run, kept: Run) -> Table:
    """All counts, each with its change, and the CPU seconds in yardsticks."""
    shown = Table("Picture", "Calls", "Elements", "Rays", "CPU (yardsticks)")
    for name, counts in found["pictures"].items():
        now, before = flat(counts), _kept(kept, name)
        rays, rays_before = (
            sum(n for what, n in each.items() if what.endswith("rays")) for each in (now, before)
        )
        seconds = kept["pictures"][name]["yardsticks"] if name in kept["pictures"] else 0.0
        shown.add_row(
            name,
            _change(now["calls"], before.get("calls", 0)),
            _change(now["elements"], before.get("elements", 0)),
            _change(rays, rays_before),
            f"{counts['yardsticks']:.1f}" + (f" ({counts['yardsticks'] / seconds:.2f} x)" if seconds else ""),
        )
    return shown


def _change(now: int, before: int) -> str:
    return f"{now:,}" if now == before else f"{now:,} ({now - before:+,})"


def main() -> int:
    """Count, and store or compare."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.counts", description="Count operations.")
    parser.add_argument("--store", action="store_true", help="keep these counts")
    options = parser.parse_args()
    found = run()
    console = Console()
    if options.store:
        KEPT.write_text(json.dumps(found, indent=2) + "\n")
        console.print(f"written to {KEPT.name}")
        return 0
    kept: Run = json.loads(KEPT.read_text())
    console.print(table(found, kept))
    more = regressions(found, kept)
    if more and comparable(found, kept):
        sys.stderr.write(
            "More is computed than before:\n  "
            + "\n  ".join(more)
            + "\nIf that is meant, say why in the commit, "
            "and keep the new counts: python -m benchmarks.counts --store\n"
        )
        return 1
    if not comparable(found, kept):
        console.print(f"Counted with NumPy {kept['numpy']}: differences from {found['numpy']} fail nothing.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
