"""How passes of target quality are shared out, what one process decides alone, and how late pictures are."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING, TypedDict

import renderer
from benchmarks.scaling import plan_of
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from renderer import RenderPlan, TileEvent

ERROR = 0.5 / 255
"""The quality without a time limit."""

OUT_OF_REACH = 0.02 / 255
"""The quality with a time limit that ends the picture."""

LAYERS = ("depth", "normal", "albedo", "samples", "error")

LIMITS = ((1024, 6.0), (1600, 8.0))
"""Sides of pictures, pixels, and their time limits, seconds."""

WORKERS = (1, 2)


class Shared(TypedDict):
    """A picture: tiles of each pass, and CPU seconds in all and of what is done between tiles."""

    side: int
    workers: int
    tiles: list[int]
    cpu_seconds: float
    serial_share: float
    seconds: float


class Late(TypedDict):
    """A picture that its time limit ends: seconds by which it came after that."""

    side: int
    workers: int
    limit: float
    layers: int
    late: float
    first_pass: float


class Passes(TypedDict):
    """All pictures."""

    shared: list[Shared]
    late: list[Late]


def measure() -> Passes:
    """Render `soft` with one worker and with two, without a limit and with one, with layers and without."""
    shared = [_shared(side, workers) for side in (512, 1024) for workers in WORKERS]
    late = [
        _late(side, workers, limit, names)
        for side, limit in LIMITS
        for workers in WORKERS
        for names in ((), LAYERS)
    ]
    return Passes(shared=shared, late=late)


def _plan(side: int, limit: float | None = None, layers: tuple[str, ...] = ()) -> RenderPlan:
    quality = TargetQuality(mode="target", error=OUT_OF_REACH if limit else ERROR, time_limit=limit)
    plan = plan_of("soft", quality, side)
    return renderer.compile_scene(plan.scene, quality, layers=layers)


def _shared(side: int, workers: int) -> Shared:
    seen: list[TileEvent] = []
    report = renderer.render(_plan(side), on_tile=seen.append, workers=workers).report
    tiles = Counter(event.pass_.index for event in seen)
    return Shared(
        side=side,
        workers=workers,
        tiles=[tiles[index] for index in range(len(report["passes"]))],
        cpu_seconds=round(report["cpu_seconds"], 3),
        serial_share=round(report["between_cpu_seconds"] / report["cpu_seconds"], 3),
        seconds=round(report["seconds"], 3),
    )


def _late(side: int, workers: int, limit: float, layers: tuple[str, ...]) -> Late:
    plan = _plan(side, limit, layers)
    begun = time.monotonic()
    report = renderer.render(plan, workers=workers).report
    return Late(
        side=side,
        workers=workers,
        limit=limit,
        layers=len(layers),
        late=round(time.monotonic() - begun - limit, 3),
        first_pass=round(report["passes"][0]["seconds"], 3),
    )
