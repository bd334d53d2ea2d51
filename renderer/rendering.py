"""A whole picture in this process or in worker processes of its own."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from renderer.adaptive.adaptive_render import render_adaptively
from renderer.arguments import LARGEST_TILE, check_callable, check_plan, checked_count, worker_count
from renderer.compiling import at_quality
from renderer.convergence import trend
from renderer.errors import tile_errors
from renderer.film import Image, clamped, compose, enlarge, non_finite
from renderer.integrator import TileResult, render_tile
from renderer.layers import LayerBuffers
from renderer.plan.plan import RenderPlan
from renderer.progressive import errors_of, squares_of, unknown_error
from renderer.results import RenderResult, TileEvent
from renderer.scenes import QualitySource
from renderer.tiling import tiles
from renderer.workers import shared_out
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile


@dataclass(slots=True, eq=False)
class _Picture:
    """Tiles as they come in."""

    plan: RenderPlan
    buffers: LayerBuffers
    parts: dict[int, list[tuple[Pass, Image]]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    work: Counter[str] = field(default_factory=Counter)
    cpu_seconds: float = 0.0
    passes: list[dict[str, Any]] = field(default_factory=list)

    def take(self, tile: Tile, pass_: Pass, result: TileResult) -> Image:
        """Keep a result; gives the tile so far."""
        self.counts.update(result.counts)
        self.work.update(result.work)
        self.cpu_seconds += result.cpu_seconds
        self.buffers.take(tile, result.layers)
        if pass_.stride > 1:
            return enlarge(result.pixels, pass_.stride, tile.height, tile.width)
        self.parts.setdefault(tile.index, []).append((pass_, result.pixels))
        return compose(self.parts[tile.index])

    def note(self, seconds: float) -> None:
        """Keep what the picture has taken when a pass ends; its error is known later, if at all."""
        cost = {"seconds": seconds, "cpu_seconds": self.cpu_seconds, "rays": dict(self.counts)}
        self.passes.append(cost | {"error": None})

    def note_errors(self) -> None:
        """Keep the errors after those passes of which they are known."""
        pixels = self.plan.width * self.plan.height
        # By number and not as they came: sums would differ by rounding.
        found = [squares_of(self.parts[number]) for number in sorted(self.parts)]
        errors = errors_of(found, pixels)
        for cost, pass_ in zip(reversed(self.passes), reversed(self.plan.passes), strict=False):
            if pass_.index in errors:
                cost["error"] = errors[pass_.index].document()

    def image(self, tile_size: int | None) -> Image:
        """All tiles in their places."""
        image = np.zeros((self.plan.height, self.plan.width, 3), dtype=np.float32)
        for tile in tiles(self.plan, self.plan.passes[-1], tile_size):
            image[tile.y0 : tile.y1, tile.x0 : tile.x1] = compose(self.parts[tile.index])
        return image


def render(
    plan: RenderPlan,
    quality: QualitySource | None = None,
    on_tile: Callable[[TileEvent], None] | None = None,
    workers: int | Literal["auto"] | None = None,
    tile_size: int | None = None,
) -> RenderResult:
    """Render a whole picture.

    Parameters
    ----------
    plan : RenderPlan
    quality : FixedQuality, TargetQuality or dict, optional
        Takes the place of the plan's; a dict is one as a request over HTTP has it.
    on_tile : callable, optional
        Called with a `TileEvent` for every finished tile, the coarse preview first.
    workers : int or "auto", optional
        Worker processes, 1 to 1024. By default the picture is rendered in this process. With "auto" there is
        one per processor, started once the picture has taken longer than starting them does. As always with
        processes, a script that uses workers does so under `if __name__ == "__main__":`.
    tile_size : int, optional
        Side of a tile, pixels, 1 to 65536. No pixel depends on it, nor on `workers`.

    Returns
    -------
    RenderResult

    Raises
    ------
    TypeError, ValueError
        If an argument is of the wrong kind, or out of range.
    SceneError
        If the quality cannot be used.
    RenderError
        If a worker process dies, or a tile cannot be rendered.
    """
    check_plan(plan, "render")
    check_callable("on_tile", on_tile)
    count, start_after = worker_count(workers)
    tile_size = checked_count("tile_size", tile_size, LARGEST_TILE, "the renderer's choice")
    if quality is not None:
        plan = at_quality(plan, quality)
    if isinstance(plan.quality, TargetQuality):
        return _converging(
            render_adaptively(plan, plan.quality, on_tile, count, tile_size, start_after), None
        )
    begun = time.perf_counter()
    rounds = plan.passes if on_tile else plan.passes[1:]
    work = [[(tile, pass_) for tile in tiles(plan, pass_, tile_size)] for pass_ in rounds]
    buffers = LayerBuffers(plan.layers, plan.height, plan.width)
    picture, done, total = _Picture(plan, buffers), 0, sum(map(len, work))
    with shared_out(count, partial(_attempt, plan), start_after) as results_of:
        for tasks in work:
            for (tile, pass_), result in results_of(tasks):
                pixels, done = picture.take(tile, pass_, result), done + 1
                if on_tile:
                    share, elapsed = done / total, time.perf_counter() - begun
                    on_tile(TileEvent(tile, pass_, pixels, done, total, share, elapsed / share - elapsed))
            picture.note(time.perf_counter() - begun)
    image = picture.image(tile_size)
    unknown = unknown_error(plan)
    if unknown is None:
        picture.note_errors()
    report = _report(plan, picture, image, time.perf_counter() - begun)
    return _converging(RenderResult(image, buffers.finished(), report, plan.document.display), unknown)


def _converging(result: RenderResult, unknown: str | None) -> RenderResult:
    """The same with how fast the error falls; `unknown` says why nothing is known of it."""
    report = result.report | {"convergence": trend(result.report["passes"], unknown)}
    return replace(result, report=report)


_Task = tuple[Tile, Pass]


def _attempt(plan: RenderPlan, task: _Task) -> TileResult:
    tile, pass_ = task
    with tile_errors(plan.seed, tile, f"samples {pass_.first}..{pass_.last}"):
        return render_tile(plan, tile, pass_)


def _report(plan: RenderPlan, picture: _Picture, image: Image, seconds: float) -> dict[str, Any]:
    shaded = [lighting.emitter.count for lighting in plan.lightings]
    return {
        "seconds": seconds,
        "cpu_seconds": picture.cpu_seconds,
        "width": plan.width,
        "height": plan.height,
        "rays": dict(picture.counts),
        "work": dict(picture.work),
        "samples": {
            "antialiasing_mean": float(plan.antialiasing.samples),
            "light_mean": float(np.mean(shaded)) if shaded else 0.0,
        },
        "error": picture.passes[-1]["error"],
        "passes": picture.passes,
        "numerics": {
            "non_finite": non_finite(image),
            "clamped": sum(map(clamped, picture.parts.values())),
        }
        | plan.numerics,
        "plan": plan.describe().model_dump(mode="json"),
    }
