"""Rendering of a whole picture in this process, or in worker processes."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from renderer.adaptive.adaptive_render import render_adaptively
from renderer.arguments import LARGEST_TILE, check_callable, check_plan, checked_count, worker_count
from renderer.compiling import at_quality
from renderer.convergence import trend
from renderer.errors import tile_errors
from renderer.film import Image, clamped, compose, enlarge
from renderer.fixed_tiles import TileResult, render_tile
from renderer.layers import LayerBuffers
from renderer.passes import Tally, run_pass
from renderer.plan.plan import RenderPlan
from renderer.progressive import errors_of, squares_of, unknown_error
from renderer.results import RenderResult, TileEvent
from renderer.scenes import QualitySource
from renderer.tiling import tiles
from renderer.workers import shared_out
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile

_Task = tuple[Tile, Pass]


class _FixedPicture:
    """A picture whose passes the plan fixes. Satisfies `passes.Picture`."""

    def __init__(
        self, plan: RenderPlan, on_tile: Callable[[TileEvent], None] | None, tile_size: int | None
    ) -> None:
        self.plan, self.tally = plan, Tally()
        self._on_tile, self._tile_size = on_tile, tile_size
        self.buffers = LayerBuffers(plan.layers, plan.height, plan.width)
        self.parts: dict[int, list[tuple[Pass, Image]]] = {}
        rounds = plan.passes if on_tile else plan.passes[1:]
        self._waiting = [[(tile, pass_) for tile in tiles(plan, pass_, tile_size)] for pass_ in rounds]
        self._done, self._total = 0, sum(map(len, self._waiting))

    def tasks(self) -> list[_Task]:
        return self._waiting.pop(0)

    def take(self, task: _Task, result: TileResult) -> None:
        tile, pass_ = task
        self.tally.count(result.counts, result.work, result.cpu_seconds)
        self.buffers.take(tile, result.layers)
        if pass_.stride == 1:
            self.parts.setdefault(tile.index, []).append((pass_, result.pixels))
        self._done += 1
        if self._on_tile:
            share, elapsed = self._done / self._total, self.tally.seconds
            pixels, left = self._so_far(tile, pass_, result), elapsed / share - elapsed
            self._on_tile(TileEvent(tile, pass_, pixels, self._done, self._total, share, left))

    def _so_far(self, tile: Tile, pass_: Pass, result: TileResult) -> Image:
        if pass_.stride > 1:
            return enlarge(result.pixels, pass_.stride, tile.height, tile.width)
        return compose(self.parts[tile.index])

    def end_pass(self) -> bool:
        # The error is known only after the last pass, if at all.
        self.tally.end_pass(None)
        return bool(self._waiting)

    def note_errors(self) -> None:
        """Record the known errors after passes."""
        pixels = self.plan.width * self.plan.height
        # In the order of numbers, not of arrival, since sums would differ by rounding.
        found = [squares_of(self.parts[number]) for number in sorted(self.parts)]
        errors = errors_of(found, pixels)
        for cost, pass_ in zip(reversed(self.tally.passes), reversed(self.plan.passes), strict=False):
            if pass_.index in errors:
                cost["error"] = errors[pass_.index].document()

    def image(self) -> Image:
        """All tiles in their places."""
        image = np.zeros((self.plan.height, self.plan.width, 3), dtype=np.float32)
        for tile in tiles(self.plan, self.plan.passes[-1], self._tile_size):
            image[tile.y0 : tile.y1, tile.x0 : tile.x1] = compose(self.parts[tile.index])
        return image

    def result(self) -> RenderResult:
        """The finished picture."""
        image, numbers = self.image(), float(self.plan.antialiasing.samples)
        report = self.tally.report(self.plan, image, numbers, sum(map(clamped, self.parts.values())))
        return RenderResult(image, self.buffers.finished(), report, self.plan.document.display)


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
    picture = _FixedPicture(plan, on_tile, tile_size)
    with shared_out(count, partial(_attempt, plan), start_after) as transport:
        while run_pass(picture, transport):
            pass
    unknown = unknown_error(plan)
    if unknown is None:
        picture.note_errors()
    return _converging(picture.result(), unknown)


def _converging(result: RenderResult, unknown: str | None) -> RenderResult:
    """Add the convergence of the error to the report; `unknown` is the reason if there is none."""
    report = result.report | {"convergence": trend(result.report["passes"], unknown)}
    return replace(result, report=report)


def _attempt(plan: RenderPlan, task: _Task) -> TileResult:
    tile, pass_ = task
    with tile_errors(plan.seed, tile, f"samples {pass_.first}..{pass_.last}"):
        return render_tile(plan, tile, pass_)
